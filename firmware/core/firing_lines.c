/* The queue of edges: sorted by time, one pattern at a time in the board's hands; and what comes back from there. */
#include "firmware/core/firing_state.h"

#include <stdatomic.h>

#define RETRY_TICKS (BOARD_TICK_HZ / 1000000)

static struct firing_edge *edge_at(struct firing *firing, unsigned i)
{
    unsigned place = firing->edge_first + i;

    return &firing->edges[place < FIRING_EDGES ? place : place - FIRING_EDGES];
}

int firing_room(const struct firing *firing)
{
    return FIRING_EDGES - firing->edge_count;
}

/* Moves the holds of the lines by one edge; returns the lines that are up then. */
static uint16_t apply(const struct firing_edge *edge, uint8_t holds[LUMI_RIG_CHANNELS], uint16_t lines)
{
    for (unsigned bit = 0, left = edge->rise; left != 0; bit++, left >>= 1)
        if (left & 1)
            holds[bit]++;
    for (unsigned bit = 0, left = edge->fall; left != 0; bit++, left >>= 1)
        if ((left & 1) && holds[bit] > 0 && --holds[bit] == 0)
            lines &= (uint16_t) ~(1u << bit);
    return lines | edge->rise;
}

/* Gives the board the next pattern. Locked, or in the interrupt; nothing is pending. */
static void arm(struct firing *firing)
{
    uint8_t holds[LUMI_RIG_CHANNELS];
    uint16_t lines = firing->lines;

    firing->armed = 0;
    if (firing->edge_count == 0)
        return;
    for (int i = 0; i < LUMI_RIG_CHANNELS; i++)
        holds[i] = firing->holds[i];
    const uint64_t at = edge_at(firing, 0)->at;
    while (firing->armed < firing->edge_count && edge_at(firing, firing->armed)->at == at)
        lines = apply(edge_at(firing, firing->armed++), holds, lines);
    firing->board->trigger_at(firing->board->port, at, lines);
}

/* An edge of the same shot at the same tick takes the lines as well; otherwise it goes in after all that are not later.
 */
static void insert(struct firing *firing, const struct firing_edge *edge)
{
    unsigned place = firing->edge_count;

    while (place > 0 && edge_at(firing, place - 1)->at > edge->at)
        place--;
    for (unsigned i = place; i > 0 && edge_at(firing, i - 1)->at == edge->at; i--) {
        struct firing_edge *same = edge_at(firing, i - 1);
        if (same->slot == edge->slot) {
            same->rise |= edge->rise;
            same->fall |= edge->fall;
            return;
        }
    }
    for (unsigned i = firing->edge_count; i > place; i--)
        *edge_at(firing, i) = *edge_at(firing, i - 1);
    *edge_at(firing, place) = *edge;
    firing->edge_count++;
    if (edge->slot != FIRING_NO_SLOT)
        firing->slots[edge->slot].edges_left++;
}

bool firing_queue(struct firing *firing, const struct firing_edge *edge, uint32_t stops)
{
    const struct board *board = firing->board;
    unsigned lock = board->lock(board->port);
    bool open = firing->stops == stops && firing->edge_count < FIRING_EDGES && firing->gate != GATE_OFF;

    if (open) {
        /* Edges come at least SHOOT_MARGIN ahead: a pending pattern that this one goes before is not about to go out.
         */
        bool again = firing->armed > 0 && edge->at <= edge_at(firing, 0)->at;
        insert(firing, edge);
        if (again)
            board->trigger_cancel(board->port);
        if (again || firing->armed == 0)
            arm(firing);
    }
    board->unlock(board->port, lock);
    return open;
}

/* One edge is out since tick `at`. */
static void stamp(struct firing *firing, const struct firing_edge *edge, uint64_t at)
{
    firing->lines = apply(edge, firing->holds, firing->lines);
    if (edge->slot == FIRING_NO_SLOT) {
        firing->pulses += edge->rise != 0;
        return;
    }
    struct firing_slot *slot = &firing->slots[edge->slot];
    slot->edges_left--;
    if (slot->use == SLOT_QUEUED)
        slot->use = SLOT_BEGUN;
    for (int i = 0; edge->rise != 0 && i < firing->camera_count; i++) {
        const struct firing_camera *c = &firing->cameras[i];
        if (edge->rise >> c->channel & 1) {
            slot->edge[c->camera] = (int64_t)(at - slot->middle);
            slot->risen |= 1u << c->camera;
            slot->late = slot->late || at > edge->at + FIRING_LATE_TICKS;
        }
    }
}

void firing_on_trigger(struct firing *firing, uint64_t at)
{
    for (; firing->armed > 0; firing->armed--) {
        stamp(firing, edge_at(firing, 0), at);
        firing->edge_first = (uint16_t)(firing->edge_first + 1 < FIRING_EDGES ? firing->edge_first + 1 : 0);
        firing->edge_count--;
    }
    arm(firing);
}

/* The pending pattern may be out already, or be put out while it is being cancelled: its shots count as begun. */
static bool too_near(struct firing *firing)
{
    const struct board *board = firing->board;

    return firing->armed > 0 && edge_at(firing, 0)->at <= board->now(board->port) + FIRING_RACE_TICKS;
}

static void stop_all(struct firing *firing)
{
    const struct board *board = firing->board;
    bool near = too_near(firing);

    for (unsigned i = 0; near && i < firing->armed; i++) {
        struct firing_edge *edge = edge_at(firing, i);
        if (edge->slot == FIRING_NO_SLOT)
            firing->pulses += edge->rise != 0;
        else if (firing->slots[edge->slot].use == SLOT_QUEUED)
            firing->slots[edge->slot].use = SLOT_BEGUN;
    }
    board->trigger_cancel(board->port);
    board->trigger_lines(board->port, 0);
    for (int i = 0; i < LUMI_RIG_CHANNELS; i++)
        firing->holds[i] = 0;
    firing->lines = 0;
    firing->armed = firing->edge_count = 0;
    for (int i = 0; i < FIRING_SLOTS; i++) {
        struct firing_slot *slot = &firing->slots[i];
        slot->edges_left = 0;
        if (slot->use == SLOT_BEGUN)
            slot->use = SLOT_BROKEN;
        else if (slot->use == SLOT_QUEUED)
            slot->use = SLOT_FREE;
    }
}

/* What has begun stays: a shot from its first edge on, and the falling edges of pulses. */
static void stop_rest(struct firing *firing)
{
    const struct board *board = firing->board;
    const bool near = too_near(firing);
    unsigned kept = near ? firing->armed : 0;

    for (unsigned i = 0; i < kept; i++) {
        struct firing_edge *edge = edge_at(firing, i);
        if (edge->slot != FIRING_NO_SLOT && firing->slots[edge->slot].use == SLOT_QUEUED)
            firing->slots[edge->slot].use = SLOT_BEGUN;
    }
    if (!near)
        board->trigger_cancel(board->port);
    for (unsigned i = kept; i < firing->edge_count; i++) {
        struct firing_edge edge = *edge_at(firing, i);
        if (edge.slot == FIRING_NO_SLOT)
            edge.rise = 0;
        if (edge.slot == FIRING_NO_SLOT ? edge.fall != 0 : firing->slots[edge.slot].use == SLOT_BEGUN)
            *edge_at(firing, kept++) = edge;
    }
    firing->edge_count = (uint16_t)kept;
    for (int i = 0; i < FIRING_SLOTS; i++)
        if (firing->slots[i].use == SLOT_QUEUED)
            firing->slots[i].use = SLOT_FREE;
    if (!near)
        arm(firing);
}

void firing_stop(struct firing *firing, bool finish)
{
    const struct board *board = firing->board;
    unsigned lock = board->lock(board->port);

    firing->stops++;
    if (finish) {
        if (firing->gate == GATE_OPEN)
            firing->gate = GATE_FINISH;
        stop_rest(firing);
    } else {
        firing->gate = GATE_OFF;
        stop_all(firing);
    }
    board->unlock(board->port, lock);
}

void firing_release(struct firing *firing)
{
    if (firing->gate == GATE_OFF)
        firing->gate = GATE_FINISH;
}

void firing_spoil(struct firing *firing)
{
    for (int i = 0; i < FIRING_SLOTS; i++)
        if (firing->slots[i].use == SLOT_BEGUN)
            firing->slots[i].late = true;
}

bool firing_begun(const struct firing *firing, uint32_t first)
{
    for (int i = 0; i < FIRING_SLOTS; i++)
        if (firing->slots[i].use == SLOT_BEGUN && firing->slots[i].number >= first)
            return true;
    return false;
}

bool firing_busy_now(const struct firing *firing)
{
    for (int i = 0; i < FIRING_SLOTS; i++)
        if (firing->slots[i].use != SLOT_FREE)
            return true;
    return firing->edge_count > 0;
}

void firing_on_feedback(struct firing *firing, int input, bool active, uint64_t at)
{
    uint32_t in = firing->stamps_in;

    if (in - firing->stamps_out == FIRING_STAMPS) {
        firing->stamps_lost++;
        return;
    }
    firing->stamps[in % FIRING_STAMPS] = (struct firing_stamp){at, (uint8_t)input, active};
    atomic_signal_fence(memory_order_seq_cst); /* the stamp before its number, for the compiler too */
    firing->stamps_in = in + 1;
}

/* The shot under way whose exposures should begin nearest to `at`, of those with a camera on this input. */
static uint32_t shot_of(const struct firing *firing, int input, uint64_t at)
{
    uint32_t shot = FIRING_NO_SHOT;
    uint64_t nearest = UINT64_MAX;
    bool wired = false;

    for (int i = 0; i < firing->camera_count; i++)
        wired = wired || firing->cameras[i].feedback == input;
    for (int i = 0; wired && i < FIRING_SLOTS; i++) {
        const struct firing_slot *slot = &firing->slots[i];
        uint64_t begin = slot->middle - firing_half(firing, slot->exposure);
        uint64_t apart = at > begin ? at - begin : begin - at;
        if ((slot->use == SLOT_BEGUN || slot->use == SLOT_BROKEN) && apart < nearest) {
            nearest = apart;
            shot = slot->number;
        }
    }
    return shot;
}

static void poll_stamps(struct firing *firing)
{
    while (firing->stamps_out != firing->stamps_in) {
        atomic_signal_fence(memory_order_seq_cst);
        struct firing_stamp stamp_in = firing->stamps[firing->stamps_out % FIRING_STAMPS];
        atomic_signal_fence(memory_order_seq_cst);
        firing->stamps_out = firing->stamps_out + 1;
        if (stamp_in.input >= LUMI_RIG_FEEDBACKS)
            continue;
        if (stamp_in.active)
            firing->last_shot[stamp_in.input] = shot_of(firing, stamp_in.input, stamp_in.at);
        firing->report_edge(firing->context, stamp_in.input, stamp_in.active, stamp_in.at,
                            firing->last_shot[stamp_in.input]);
    }
}

void firing_poll(struct firing *firing)
{
    const uint64_t now = firing->board->now(firing->board->port);

    poll_stamps(firing);
    for (int i = 0; i < FIRING_SLOTS; i++) {
        struct firing_slot *slot = &firing->slots[i];
        if (slot->use == SLOT_BROKEN || (slot->use == SLOT_BEGUN && slot->edges_left == 0 && now >= slot->end))
            firing_finish_shot(firing, slot);
    }
}

uint64_t firing_next_poll(const struct firing *firing)
{
    const uint64_t now = firing->board->now(firing->board->port);
    uint64_t next = firing->stamps_in != firing->stamps_out ? now : BOARD_NEVER;

    for (int i = 0; i < FIRING_SLOTS; i++) {
        const struct firing_slot *slot = &firing->slots[i];
        uint64_t due = slot->use == SLOT_BROKEN ? now : slot->end;
        if (slot->use != SLOT_BROKEN && slot->edges_left > 0 && due <= now)
            due = now + RETRY_TICKS;
        if (slot->use != SLOT_FREE && due < next)
            next = due;
    }
    return next;
}
