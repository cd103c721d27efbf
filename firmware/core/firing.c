/* Shots: what each wants of the lines, which may be taken, what became of them. The lines themselves: firing_lines.c.
 */
#include "firmware/core/firing_state.h"

#define LINE_GAP_TICKS (BOARD_TICK_HZ / 1000) /* a trigger line is down at least 1 ms before it goes up again */
#define SHOOT_MARGIN_TICKS (BOARD_TICK_HZ / 4000)

static uint64_t ticks_of(double seconds)
{
    return seconds > 0 ? (uint64_t)(seconds * BOARD_TICK_HZ + 0.5) : 0;
}

static uint64_t larger(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

void firing_init(struct firing *firing, const struct board *board, struct firing_edge *edges, firing_report report,
                 firing_report_edge report_edge, void *context)
{
    *firing = (struct firing){
        .board = board, .edges = edges, .report = report, .report_edge = report_edge, .context = context};
    for (int i = 0; i < LUMI_RIG_FEEDBACKS; i++)
        firing->last_shot[i] = FIRING_NO_SHOT;
    board->trigger_lines(board->port, 0);
}

static void take_cameras(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras)
{
    firing->camera_count = 0;
    firing->shot_edges = 0;
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_rig_trigger *t = &rig->control.triggers[i];
        if (t->channel < 0 || (cameras != 0 && !(cameras >> i & 1)))
            continue;
        struct firing_camera *c = &firing->cameras[firing->camera_count++];
        *c = (struct firing_camera){.camera = (uint8_t)i,
                                    .channel = (int8_t)t->channel,
                                    .focus_channel = (int8_t)(t->focus_lead > 0 ? t->focus_channel : -1),
                                    .feedback = (int8_t)t->feedback,
                                    .lag = (uint32_t)ticks_of(t->shutter_lag),
                                    .pulse = (uint32_t)ticks_of(t->pulse),
                                    .focus_lead = (uint32_t)ticks_of(t->focus_lead),
                                    .busy = ticks_of(t->busy)};
        firing->camera_of_channel[t->channel] = (uint8_t)i;
        firing->shot_edges += c->focus_channel >= 0 ? 3 : 2;
    }
}

void firing_begin(struct firing *firing, const struct lumi_rig *rig, const struct lumi_plan *plan)
{
    take_cameras(firing, rig, plan->cameras);
    firing->exposure_count = plan->bracket;
    for (int i = 0; i < plan->bracket; i++)
        firing->exposures[i] = ticks_of(plan->exposures[i]);
    firing->gate = GATE_OPEN;
}

enum shot_state firing_state(const struct firing *firing, uint32_t number)
{
    if (number >= LUMI_PLAN_SHOTS_MAX)
        return SHOT_LOST;
    return (enum shot_state)(firing->states[number / 4] >> number % 4 * 2 & 3);
}

static void set_state(struct firing *firing, uint32_t number, enum shot_state state)
{
    enum shot_state old = firing_state(firing, number);

    if (number >= LUMI_PLAN_SHOTS_MAX || old == state)
        return;
    if (state == SHOT_PLANNED && number < firing->first_planned)
        firing->first_planned = number;
    firing->fired += (state == SHOT_FIRED) - (old == SHOT_FIRED);
    firing->lost += (state == SHOT_LOST) - (old == SHOT_LOST);
    unsigned shift = number % 4 * 2;
    firing->states[number / 4] = (uint8_t)((firing->states[number / 4] & ~(3u << shift)) | (unsigned)state << shift);
}

void firing_mark(struct firing *firing, uint32_t first, uint32_t count, enum shot_state state)
{
    for (uint32_t i = 0; i < count && first + i < LUMI_PLAN_SHOTS_MAX; i++)
        set_state(firing, first + i, state);
}

void firing_plan_again(struct firing *firing, uint32_t first, uint32_t count)
{
    firing_mark(firing, first, count, SHOT_PLANNED);
}

uint32_t firing_next_planned(struct firing *firing)
{
    while (firing->first_planned < LUMI_PLAN_SHOTS_MAX && firing_state(firing, firing->first_planned) != SHOT_PLANNED)
        firing->first_planned++;
    return firing->first_planned;
}

void firing_count(const struct firing *firing, uint32_t *fired, uint32_t *lost)
{
    *fired = firing->fired;
    *lost = firing->lost;
}

bool firing_pending(const struct firing *firing, uint32_t number)
{
    for (int i = 0; i < FIRING_SLOTS; i++)
        if (firing->slots[i].use != SLOT_FREE && firing->slots[i].number == number)
            return true;
    return false;
}

uint64_t firing_half(const struct firing *firing, int exposure)
{
    return firing->exposures[exposure] / 2;
}

/* A focus line falls with the trigger and is up again so long before the next one. */
static uint32_t focus_ticks(const struct firing_camera *camera)
{
    return camera->focus_channel >= 0 ? camera->focus_lead : 0;
}

uint64_t firing_lead(const struct firing *firing, int exposure)
{
    uint64_t lead = 0;

    for (int i = 0; i < firing->camera_count; i++) {
        const struct firing_camera *c = &firing->cameras[i];
        lead = larger(lead, (uint64_t)c->lag + focus_ticks(c));
    }
    return lead + firing_half(firing, exposure) + FIRING_MARGIN_TICKS;
}

uint64_t firing_spacing(const struct firing *firing, int from, int to, uint64_t gap)
{
    uint64_t spacing = 0;

    for (int i = 0; i < firing->camera_count; i++) {
        const struct firing_camera *c = &firing->cameras[i];
        uint64_t after = firing->exposures[from] - firing_half(firing, from);
        uint64_t rest = after + larger(gap, c->busy) + c->lag + firing_half(firing, to);
        uint64_t line = c->pulse + LINE_GAP_TICKS + focus_ticks(c) + firing_half(firing, to);
        uint64_t begun = firing_half(firing, from);
        spacing = larger(spacing, larger(rest, line > begun ? line - begun : 0));
    }
    return spacing;
}

/* The report of a shot whose state is decided. */
void firing_finish_shot(struct firing *firing, struct firing_slot *slot)
{
    struct shot_record record = {.number = slot->number,
                                 .exposure = slot->exposure,
                                 .cameras = slot->risen,
                                 .middle = slot->middle,
                                 .position = slot->position};
    uint32_t all = 0;

    for (int i = 0; i < firing->camera_count; i++) {
        const struct firing_camera *c = &firing->cameras[i];
        all |= 1u << c->camera;
        if (slot->risen >> c->camera & 1) {
            record.lines |= (uint16_t)(1u << c->channel);
            record.edge[c->channel] = slot->edge[c->camera];
        }
    }
    bool fired = slot->use == SLOT_BEGUN && !slot->late && slot->risen == all;
    record.state = fired ? SHOT_FIRED : SHOT_LOST;
    set_state(firing, slot->number, record.state);
    slot->use = SLOT_FREE;
    firing->report(firing->context, &record);
}

void firing_lose(struct firing *firing, uint32_t number, int exposure, uint64_t middle, double position)
{
    struct shot_record record = {
        .number = number, .state = SHOT_LOST, .exposure = exposure, .middle = middle, .position = position};

    set_state(firing, number, SHOT_LOST);
    firing->report(firing->context, &record);
}

/* Queues one camera's lines for an exposure in the middle of `slot`. */
static bool queue_camera(struct firing *firing, struct firing_camera *c, struct firing_slot *slot, uint64_t begin,
                         uint32_t stops)
{
    const uint8_t index = (uint8_t)(slot - firing->slots);
    const uint16_t line = (uint16_t)(1u << c->channel);
    const uint16_t focus = (uint16_t)(c->focus_channel >= 0 ? 1u << c->focus_channel : 0);
    const uint64_t rise = begin - c->lag, fall = rise + c->pulse;
    bool open = true;

    if (focus != 0)
        open = firing_queue(firing, &(struct firing_edge){rise - c->focus_lead, focus, 0, index}, stops);
    open = open && firing_queue(firing, &(struct firing_edge){rise, line, 0, index}, stops);
    open = open && firing_queue(firing, &(struct firing_edge){fall, 0, line | focus, index}, stops);
    c->free_at = larger(begin + firing->exposures[slot->exposure] + c->busy, fall + LINE_GAP_TICKS + focus_ticks(c));
    slot->end = larger(slot->end, fall);
    return open;
}

/* Whether all cameras would take a trigger for an exposure that begins then. */
static bool all_free(const struct firing *firing, uint64_t begin)
{
    for (int i = 0; i < firing->camera_count; i++)
        if (begin - firing->cameras[i].lag < firing->cameras[i].free_at)
            return false;
    return firing->camera_count > 0;
}

bool firing_shoot(struct firing *firing, uint32_t number, int exposure, uint64_t middle, double position)
{
    const uint32_t stops = firing->stops;
    const uint64_t now = firing->board->now(firing->board->port);
    const uint64_t lead = firing_lead(firing, exposure) - FIRING_MARGIN_TICKS;
    const uint64_t begin = middle - firing_half(firing, exposure);
    struct firing_slot *slot = NULL;

    if (firing->gate != GATE_OPEN)
        return false;
    if (middle < now + lead + SHOOT_MARGIN_TICKS || !all_free(firing, begin)) {
        firing_lose(firing, number, exposure, middle, position);
        return true;
    }
    for (int i = 0; i < FIRING_SLOTS && slot == NULL; i++)
        if (firing->slots[i].use == SLOT_FREE)
            slot = &firing->slots[i];
    if (slot == NULL || firing_room(firing) < firing->shot_edges)
        return false;

    *slot = (struct firing_slot){.number = number,
                                 .exposure = (uint8_t)exposure,
                                 .middle = middle,
                                 .end = begin + firing->exposures[exposure],
                                 .position = position};
    slot->use = SLOT_QUEUED;
    for (int i = 0; i < firing->camera_count; i++)
        if (!queue_camera(firing, &firing->cameras[i], slot, begin, stops)) {
            if (slot->use == SLOT_QUEUED)
                slot->use = SLOT_FREE;
            return false; /* stopped meanwhile: the shot is as planned as before */
        }
    return true;
}

/* A pulse outside any shot. */
static bool queue_pulse(struct firing *firing, uint16_t lines, uint64_t rise, uint64_t fall, uint32_t stops)
{
    return firing_queue(firing, &(struct firing_edge){rise, lines, 0, FIRING_NO_SLOT}, stops) &&
           firing_queue(firing, &(struct firing_edge){fall, 0, lines, FIRING_NO_SLOT}, stops);
}

bool firing_test(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, double exposure, double gap)
{
    const uint32_t stops = firing->stops;
    uint64_t at = firing->board->now(firing->board->port) + FIRING_MARGIN_TICKS;

    if (firing_busy_now(firing))
        return false;
    firing_recording(firing);
    firing->record_asked = false; /* these pulses are none of its */
    take_cameras(firing, rig, cameras);
    if (firing->camera_count == 0)
        return false;
    firing->gate = GATE_FINISH;
    for (int i = 0; i < firing->camera_count; i++) {
        const struct firing_camera *c = &firing->cameras[i];
        uint64_t taken = larger(c->pulse, c->lag + ticks_of(exposure) + c->busy);
        if (c->focus_channel >= 0) {
            uint16_t focus = (uint16_t)(1u << c->focus_channel);
            if (!queue_pulse(firing, focus, at, at + c->focus_lead + c->pulse, stops))
                return true;
            at += c->focus_lead;
        }
        if (!queue_pulse(firing, (uint16_t)(1u << c->channel), at, at + c->pulse, stops))
            return true; /* stopped: what became of it is told by that */
        at += taken + larger(ticks_of(gap), LINE_GAP_TICKS);
    }
    return true;
}

bool firing_recording(struct firing *firing)
{
    if (firing->record_asked && firing->pulses != firing->pulses_before) {
        firing->recording = firing->record_start;
        firing->record_asked = false;
    }
    return firing->recording;
}

/* A record pulse is about to be queued. */
static void ask_record(struct firing *firing, bool start)
{
    firing_recording(firing);
    firing->record_asked = true;
    firing->record_start = start;
    firing->pulses_before = firing->pulses;
}

bool firing_record(struct firing *firing, const struct lumi_rig *rig, uint32_t cameras, bool start, uint64_t at)
{
    const uint32_t stops = firing->stops;
    const uint64_t pulse = ticks_of(rig->control.video.record_pulse);

    if (firing_room(firing) < 2)
        return false;
    ask_record(firing, start);
    if (start) {
        take_cameras(firing, rig, cameras);
        firing->record_lines = 0;
        for (int i = 0; i < firing->camera_count; i++)
            firing->record_lines |= (uint16_t)(1u << firing->cameras[i].channel);
    }
    const uint16_t lines = firing->record_lines;
    if (pulse > 0)
        return queue_pulse(firing, lines, at, at + pulse, stops);
    if (start)
        return firing_queue(firing, &(struct firing_edge){at, lines, 0, FIRING_NO_SLOT}, stops);
    /* Held lines that fall: now, or they have fallen already. */
    firing->record_asked = firing->recording = false;
    return firing_queue(firing, &(struct firing_edge){at, 0, lines, FIRING_NO_SLOT}, stops);
}
