/* What the switches say: contacts closed by the mechanics, their bounce, and what a fault makes of them. */
#include "sim/rig/mechanics_priv.h"

#include "proto/mechanism/kinematics.h"
#include "sim/random.h"

#include <math.h>

enum { CHANNEL_BOUNCE = 11 };

static double index_steps(const struct sim_mechanics *m)
{
    return m->options.index_width / (2 * LUMI_PI) * m->platform.steps_per_turn;
}

/* The edges of the index mark on both sides of `place`, kept until it leaves them. */
static void find_edges(struct sim_mechanics *m, double place)
{
    double turn = m->platform.steps_per_turn, width = index_steps(m);
    double closes = m->options.index_angle / (2 * LUMI_PI) * turn;

    if (place >= m->edge_below && place < m->edge_above)
        return;
    closes += floor((place - closes) / turn) * turn;
    m->on_mark = place < closes + width;
    m->edge_below = m->on_mark ? closes : closes + width;
    m->edge_above = m->on_mark ? closes + width : closes + turn;
}

double sim_switches_distance(struct sim_mechanics *m)
{
    double place = sim_platform_place(m);

    find_edges(m, place);
    return fmin(place - m->edge_below, m->edge_above - place);
}

static bool string_contact(const struct sim_mechanics *m, enum board_input input)
{
    const struct lumi_rig *rig = &m->truth;
    const struct lumi_rig_string *s = &rig->string;
    double turns = sim_platform_place(m) / m->platform.steps_per_turn;
    double h = s->anchor, a = s->hold, start = 0;

    if (s->held)
        return false;
    switch (input) {
    case BOARD_IN_WOUND:
        return turns <= m->options.wound_turns;
    case BOARD_IN_SLACK:
        return m->platform.loose > m->options.slack_angle;
    default:
        if (s->run == LUMI_RIG_RUN_STRAIGHT)
            start = sqrt(fmax(h * h + a * a - 2 * h * a * sin(s->hold_angle), 0));
        return start + (turns - m->options.end_turns) * s->per_turn > s->length;
    }
}

static bool contact_of(struct sim_mechanics *m, enum board_input input)
{
    switch (input) {
    case BOARD_IN_INDEX:
        find_edges(m, sim_platform_place(m));
        return m->on_mark;
    case BOARD_IN_SLACK:
    case BOARD_IN_STRING_END:
    case BOARD_IN_WOUND:
        return string_contact(m, input);
    case BOARD_IN_DRIVER_FAULT:
        return m->driver_fault;
    case BOARD_IN_REACHED:
        return m->reached;
    default:
        return false;
    }
}

static void schedule(struct sim_mechanics *m, enum board_input input, bool active, uint64_t at)
{
    int i = m->edge_count;

    if (m->edge_count == SIM_EDGES)
        return;
    for (; i > 0 && m->edges[i - 1].at > at; i--)
        m->edges[i] = m->edges[i - 1];
    m->edges[i] = (struct sim_edge){at, input, active};
    m->edge_count++;
}

/* The contact changes at `at`: it touches, and with bounce it comes off and touches again a few times. */
static void change(struct sim_mechanics *m, enum board_input input, bool active, uint64_t at)
{
    uint64_t seed = m->options.seed, n = m->bounces++, bounce = TICKS(m->options.switch_bounce);
    int kept = 0;

    for (int i = 0; i < m->edge_count; i++) /* a change ends what is left of the last one's bounce */
        if (m->edges[i].input != input)
            m->edges[kept++] = m->edges[i];
    m->edge_count = kept;
    m->contact[input] = active;
    schedule(m, input, active, at);
    if (input == BOARD_IN_DRIVER_FAULT || input == BOARD_IN_REACHED || bounce == 0) /* no contacts */
        return;
    int pairs = (int)(sim_random(seed, n, CHANNEL_BOUNCE) % 4);
    uint64_t t = at;
    for (int i = 0; i < pairs; i++) {
        uint64_t bits = sim_random(seed, n, CHANNEL_BOUNCE + 1 + (unsigned)i);
        uint64_t off = 1 + (bits & 0xffff) * (bounce / (uint64_t)(2 * pairs)) / 65536;
        uint64_t on = 1 + (bits >> 32 & 0xffff) * (bounce / (uint64_t)(2 * pairs)) / 65536;
        schedule(m, input, !active, t + off);
        schedule(m, input, active, t + off + on);
        t += off + on;
    }
}

bool sim_switches_level(const struct sim_mechanics *m, enum board_input input)
{
    return m->force[input] == SIM_FORCE_NONE ? m->level[input] : m->force[input] == SIM_FORCE_ACTIVE;
}

/* Where between `since` and now the index changed: along a straight line. */
static uint64_t crossing(const struct sim_mechanics *m, double before, uint64_t since)
{
    double after = sim_platform_place(m), turn = m->platform.steps_per_turn;
    double closes = m->options.index_angle / (2 * LUMI_PI) * turn, best = 1;

    for (int i = 0; i < 2; i++) {
        double edge = closes + (i ? index_steps(m) : 0);
        double k = ceil((fmin(before, after) - edge) / turn), place = edge + k * turn;
        if (place <= fmax(before, after) && after != before)
            best = fmin(best, (place - before) / (after - before));
    }
    return since + (uint64_t)(best * (double)(m->now - since));
}

void sim_switches_look(struct sim_mechanics *m, double before, uint64_t since)
{
    for (int i = 0; i < BOARD_INPUTS; i++) {
        enum board_input input = (enum board_input)i;
        bool contact = contact_of(m, input);
        if (contact != m->contact[input])
            change(m, input, contact, input == BOARD_IN_INDEX ? crossing(m, before, since) : m->now);
    }
}

void sim_switches_run(struct sim_mechanics *m)
{
    while (m->edge_count > 0 && m->edges[0].at <= m->now) {
        struct sim_edge edge = m->edges[0];
        m->edge_count--;
        for (int i = 0; i < m->edge_count; i++)
            m->edges[i] = m->edges[i + 1];
        if (m->level[edge.input] == edge.active)
            continue;
        m->level[edge.input] = edge.active;
        if (m->force[edge.input] == SIM_FORCE_NONE)
            sim_mechanics_tell(m, false, edge.input, edge.active, edge.at);
    }
}

void sim_switches_start(struct sim_mechanics *m)
{
    for (int i = 0; i < BOARD_INPUTS; i++)
        m->contact[i] = m->level[i] = contact_of(m, (enum board_input)i);
}

void sim_mechanics_force_input(struct sim_mechanics *m, enum board_input input, enum sim_force force)
{
    bool before = sim_switches_level(m, input);

    m->force[input] = force;
    if (sim_switches_level(m, input) != before)
        sim_mechanics_tell(m, false, input, !before, m->now);
}

void sim_mechanics_pulse_input(struct sim_mechanics *m, enum board_input input, double seconds)
{
    schedule(m, input, !m->level[input], m->now);
    schedule(m, input, m->contact[input], m->now + TICKS(seconds));
}

void sim_mechanics_set_bounce(struct sim_mechanics *m, double seconds)
{
    m->options.switch_bounce = seconds;
}
