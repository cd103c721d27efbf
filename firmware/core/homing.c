/* Finding the index mark: one phase after another, each a move that ends early when its switch speaks. */
#include "firmware/core/homing_state.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <string.h>

#define SEARCH_TURNS 1.1
#define MARK_TURNS 0.5           /* a mark is narrower */
#define MARGIN_TURNS (1.0 / 180) /* of the approach's begin below the mark, beside backlash */
#define APPROACH_TURNS 0.05      /* beyond where the mark should come */
#define SLACK_TURNS 0.05         /* a string that hangs loose longer than that while it is paid out or wound */
#define TAKE_UP_TURNS 1.0        /* one that was loose from the start is given that to be wound tight */
#define POLL_TICKS (BOARD_TICK_HZ / 500)

void homing_init(struct homing *homing, const struct board *board)
{
    memset(homing, 0, sizeof *homing);
    homing->board = board;
}

static double turns_to_steps(const struct homing *homing, double turns)
{
    return turns * lumi_rig_steps_per_turn(homing->rig);
}

static int64_t backlash_steps(const struct homing *homing)
{
    return (int64_t)ceil(turns_to_steps(homing, homing->rig->control.motion.backlash / (2 * LUMI_PI))) + 1;
}

static int64_t margin_steps(const struct homing *homing)
{
    return (int64_t)ceil(turns_to_steps(homing, MARGIN_TURNS)) + 1;
}

/* Goes over to `phase` as soon as the platform stands. */
static void then(struct homing *homing, enum homing_phase phase)
{
    homing->next = phase;
    motion_stop(homing->motion);
}

static void give_up(struct homing *homing, const char *reason)
{
    if (homing->next == HOMING_GIVE_UP || homing->phase == HOMING_GIVE_UP)
        return;
    homing->reason = reason;
    then(homing, HOMING_GIVE_UP);
}

static void seek(struct homing *homing, int64_t steps, double speed)
{
    const struct lumi_rig_motion *m = &homing->rig->control.motion;
    double per_radian = turns_to_steps(homing, 1 / (2 * LUMI_PI));
    const struct motion_limits limits = {.speed = speed * per_radian,
                                         .acceleration = m->acceleration_max * per_radian,
                                         .jerk = m->jerk_max * per_radian};

    if (steps != 0 && !motion_seek(homing->motion, steps, &limits))
        give_up(homing, "homing: the motor cannot be started");
}

static double string_turns(const struct lumi_rig *rig)
{
    double turns = rig->turns;

    if (!rig->string.held && rig->string.per_turn > 0)
        turns = fmax(turns, rig->string.length / rig->string.per_turn);
    return fmin(turns, LUMI_RIG_TURNS_MAX);
}

static void enter(struct homing *homing, enum homing_phase phase)
{
    const struct lumi_rig_motion *m = &homing->rig->control.motion;
    int64_t position = motion_position(homing->motion), below;

    homing->phase = phase;
    homing->next = HOMING_IDLE;
    homing->began = position;
    homing->since = homing->board->now(homing->board->port);
    switch (phase) {
    case HOMING_WIND:
        seek(homing, -(int64_t)turns_to_steps(homing, string_turns(homing->rig) + SEARCH_TURNS), m->wind_speed);
        break;
    case HOMING_BACK:
        homing->on_mark = homing->index.settled;
        homing->mark = position;
        seek(homing, -(int64_t)turns_to_steps(homing, SEARCH_TURNS + MARK_TURNS), m->home_speed);
        break;
    case HOMING_FORTH:
        if (homing->index.settled)
            give_up(homing, "homing: the arm is up while the index switch is closed: one of the two must be moved");
        else
            seek(homing, (int64_t)turns_to_steps(homing, SEARCH_TURNS), m->home_speed);
        break;
    case HOMING_CLEAR:
        below = homing->mark - backlash_steps(homing) - margin_steps(homing);
        if (below < position)
            seek(homing, below - position, m->home_speed);
        break;
    case HOMING_APPROACH:
        if (homing->index.settled)
            give_up(homing, "homing: the index switch does not open below its mark");
        else
            seek(homing,
                 homing->mark - position + 2 * (backlash_steps(homing) + margin_steps(homing)) +
                     (int64_t)turns_to_steps(homing, APPROACH_TURNS),
                 m->home_speed / 4);
        break;
    case HOMING_SET:
    case HOMING_GIVE_UP:
    case HOMING_SETTLE:
    case HOMING_IDLE:
        break;
    }
}

void homing_start(struct homing *homing, struct motion *motion, const struct lumi_rig *rig, enum homing_goal goal,
                  int turn)
{
    const struct board *board = homing->board;

    homing->motion = motion;
    homing->rig = rig;
    homing->wind = goal == HOMING_WOUND;
    homing->turn = homing->wind ? 0 : turn;
    homing->result = HOMING_RUNNING;
    homing->reason = "";
    homing->slack = false;
    motion_forget(motion);
    unsigned state = board->lock(board->port);
    debounce_init(&homing->index, board->input(board->port, BOARD_IN_INDEX));
    debounce_init(&homing->wound, board->input(board->port, BOARD_IN_WOUND));
    enter(homing, HOMING_SETTLE);
    board->unlock(board->port, state);
    if (motion_moving(motion))
        give_up(homing, "homing: the platform turns");
    else if (homing->wind && !rig->control.safety.wound_fitted)
        give_up(homing, "homing: the profile has no switch for the arm's upper end");
}

/* Reads a switch; true: it has changed for good. */
static bool poll_switch(struct homing *homing, struct debounce *debounce, enum board_input input, uint64_t now,
                        struct debounce_edge *edge)
{
    const struct board *board = homing->board;
    unsigned state = board->lock(board->port);

    /* An edge whose interrupt was missed. */
    debounce_input(debounce, board->input(board->port, input), motion_position(homing->motion), now);
    bool changed = debounce_poll(debounce, now, edge);
    board->unlock(board->port, state);
    return changed;
}

static void watch_slack(struct homing *homing)
{
    const struct board *board = homing->board;
    int64_t position = motion_position(homing->motion);
    bool slack = homing->rig->control.safety.slack_fitted && board->input(board->port, BOARD_IN_SLACK);

    if (!slack || !homing->slack) {
        homing->slack_at = position;
        homing->slack_from_start = homing->phase == HOMING_SETTLE;
    }
    homing->slack = slack;
    double loose = fabs((double)(position - homing->slack_at));
    bool winding = position < homing->slack_at;
    if (loose > turns_to_steps(homing, winding && homing->slack_from_start ? TAKE_UP_TURNS : SLACK_TURNS))
        give_up(homing, winding ? "homing: the string is slack while it is wound up"
                                : "homing: the string is slack while it is paid out");
}

/* The index switch has changed. */
static void on_index(struct homing *homing, const struct debounce_edge *edge)
{
    switch (homing->phase) {
    case HOMING_BACK:
        homing->mark = edge->position;
        homing->on_mark = edge->active;
        if (!edge->active)
            then(homing, HOMING_CLEAR);
        break;
    case HOMING_FORTH:
    case HOMING_APPROACH:
        if (!edge->active)
            break;
        homing->mark = edge->position;
        then(homing, homing->phase == HOMING_FORTH ? HOMING_CLEAR : HOMING_SET);
        break;
    default:
        break;
    }
}

static void watch_wound(struct homing *homing)
{
    if (!homing->rig->control.safety.wound_fitted || !homing->wound.settled)
        return;
    if (homing->phase == HOMING_WIND || homing->phase == HOMING_BACK) {
        homing->turn = 0;
        then(homing, HOMING_FORTH);
    }
}

/* The phase's bounds while it moves. */
static void watch_bounds(struct homing *homing)
{
    double gone = fabs((double)(motion_position(homing->motion) - homing->began));
    double on_mark = fabs((double)(motion_position(homing->motion) - homing->mark));

    if (homing->phase != HOMING_BACK)
        return;
    if (homing->on_mark && on_mark > turns_to_steps(homing, MARK_TURNS))
        give_up(homing, "homing: the index switch does not open within half a turn");
    else if (!homing->on_mark && gone > turns_to_steps(homing, SEARCH_TURNS))
        give_up(homing, "homing: no index mark within a turn and a tenth");
}

/* It stands, and nothing stopped it: what comes after the phase, or why it has failed. */
static void on_rest(struct homing *homing)
{
    switch (homing->phase) {
    case HOMING_SETTLE:
        if (homing->rig->control.safety.wound_fitted && homing->wound.settled) {
            homing->turn = 0;
            enter(homing, HOMING_FORTH);
        } else {
            enter(homing, homing->wind ? HOMING_WIND : HOMING_BACK);
        }
        break;
    case HOMING_CLEAR:
        enter(homing, HOMING_APPROACH);
        break;
    case HOMING_WIND:
        give_up(homing, "homing: the arm did not come up, its switch never closed");
        break;
    case HOMING_BACK:
    case HOMING_FORTH:
        give_up(homing, "homing: no index mark within a turn and a tenth");
        break;
    case HOMING_APPROACH:
        give_up(homing, "homing: the index mark was not found again in the slow approach");
        break;
    default:
        break;
    }
}

static void finish(struct homing *homing)
{
    int64_t step = llround(turns_to_steps(homing, homing->turn)); /* of its turn, which may be −1 */

    if (homing->phase == HOMING_SET) {
        motion_set_position(homing->motion, step + motion_position(homing->motion) - homing->mark);
        homing->result = HOMING_DONE;
    } else {
        homing->result = HOMING_FAILED;
    }
    homing->phase = HOMING_IDLE;
}

enum homing_result homing_poll(struct homing *homing, const char **reason)
{
    const struct board *board = homing->board;
    struct debounce_edge edge;

    *reason = homing->reason;
    if (homing->phase == HOMING_IDLE)
        return homing->result;
    uint64_t now = board->now(board->port);
    bool moving = motion_moving(homing->motion); /* before the switches: what they said in the last step counts */

    if (motion_halted(homing->motion)) {
        give_up(homing, "homing: the motor was halted");
    } else {
        watch_slack(homing);
        bool open = homing->next == HOMING_IDLE; /* a stop has been decided on: edges on the way mean nothing */
        if (poll_switch(homing, &homing->index, BOARD_IN_INDEX, now, &edge) && open)
            on_index(homing, &edge);
        poll_switch(homing, &homing->wound, BOARD_IN_WOUND, now, &edge);
        if (homing->next == HOMING_IDLE)
            watch_wound(homing);
        if (homing->next == HOMING_IDLE)
            watch_bounds(homing);
    }
    bool quiet = !homing->index.bouncing && !homing->wound.bouncing && now >= homing->since + DEBOUNCE_TICKS;
    if (moving || (!quiet && homing->next != HOMING_GIVE_UP))
        return HOMING_RUNNING;
    if (homing->next == HOMING_IDLE)
        on_rest(homing);
    else
        enter(homing, homing->next);
    if (homing->phase == HOMING_SET || homing->phase == HOMING_GIVE_UP)
        finish(homing);
    *reason = homing->reason;
    return homing->phase == HOMING_IDLE ? homing->result : HOMING_RUNNING;
}

void homing_cancel(struct homing *homing)
{
    if (homing->phase == HOMING_IDLE)
        return;
    motion_stop(homing->motion);
    motion_forget(homing->motion);
    homing->reason = "homing: cancelled";
    homing->result = HOMING_FAILED;
    homing->phase = HOMING_IDLE;
}

void homing_on_input(struct homing *homing, enum board_input input, bool active, uint64_t at)
{
    if (homing->phase == HOMING_IDLE)
        return;
    if (input == BOARD_IN_INDEX)
        debounce_input(&homing->index, active, motion_position(homing->motion), at);
    else if (input == BOARD_IN_WOUND)
        debounce_input(&homing->wound, active, motion_position(homing->motion), at);
}

bool homing_active(const struct homing *homing)
{
    return homing->phase != HOMING_IDLE;
}

uint64_t homing_next_poll(const struct homing *homing)
{
    const struct board *board = homing->board;

    return homing->phase == HOMING_IDLE ? BOARD_NEVER : board->now(board->port) + POLL_TICKS;
}
