/* Events laid over the shots of a sweep, as cheaply as can be (dynamic programming over both in order). */
#include "pipeline/exchange/shot_match_priv.h"

#include <math.h>
#include <stdint.h>

#define MISSING 0.9   /* a shot that no camera has */
#define OUTSIDE 0.8   /* an event before or behind the sweep that all cameras took part in */
#define BETWEEN 2.0   /* one within it */
#define PAUSE 1.5     /* the beat comes late */
#define EARLY 1.0     /* it comes early by more than its tolerance, */
#define EARLIER 6.0   /* and for every whole beat that it does */
#define LABEL 2.0     /* an exposure of another place in the bracket */
#define TOLERANCE 0.3 /* of the time between two shots */
#define SLACK 64      /* shots that may be missing everywhere before the sweep is out of step */
#define SKIP_EVENTS 6 /* events in a row that are none */
#define SKIP_SHOTS 4  /* shots in a row that are missing, whatever the time says */
#define CELLS_MAX (1 << 27)

struct cell {
    float cost;
    int16_t events, shots; /* back to the one before; 0: the sweep begins here */
};

struct table {
    GArray *events;
    const struct shot_beat *beat;
    int shots, cameras, below, width; /* event e has cells for the shots e − below … e − below + width − 1 */
    struct cell *cells;
    double *before; /* share of the cameras that took part in the events before e, added up */
};

static struct cell *cell_at(const struct table *table, int event, int shot)
{
    int at = shot - (event - table->below);

    if (event < 0 || shot < 0 || shot >= table->shots || at < 0 || at >= table->width)
        return NULL;
    return &table->cells[(size_t)event * (size_t)table->width + (size_t)at];
}

static const struct shot_event *event_at(const struct table *table, int event)
{
    return &g_array_index(table->events, struct shot_event, event);
}

static double step_cost(const struct table *table, int from, int to, int from_shot, int to_shot)
{
    double elapsed = event_at(table, to)->time - event_at(table, from)->time;
    double expected = shot_elapsed(table->beat, from_shot, to_shot);
    double off = elapsed - expected, tolerance = TOLERANCE * table->beat->least;
    double cost = BETWEEN * (table->before[to] - table->before[from + 1]) + MISSING * (to_shot - from_shot - 1);

    if (fabs(off) <= tolerance)
        return cost + 0.05 * off * off / (tolerance * tolerance);
    if (off > 0)
        return cost + PAUSE;
    return cost + EARLY + EARLIER * fmax(-off / fmax(expected, 1e-9) - TOLERANCE, 0);
}

static void try_from(const struct table *table, struct cell *cell, int event, int shot, int events, int shots)
{
    const struct cell *before = events <= event ? cell_at(table, event - events, shot - shots) : NULL;

    if (!before || shots < 1 || shots > INT16_MAX)
        return;
    float cost = before->cost + (float)step_cost(table, event - events, event, shot - shots, shot);
    if (cost < cell->cost)
        *cell = (struct cell){cost, (int16_t)events, (int16_t)shots};
}

static void fill_cell(const struct table *table, int event, int shot)
{
    struct cell *cell = cell_at(table, event, shot);
    const struct shot_event *here = event_at(table, event);
    bool other = here->label >= 0 && here->label != shot % table->beat->bracket;

    if (!cell)
        return;
    *cell = (struct cell){(float)(OUTSIDE * table->before[event] + MISSING * shot), 0, 0};
    for (int events = 1; events <= SKIP_EVENTS && events <= event; events++) {
        double beats = (here->time - event_at(table, event - events)->time) / table->beat->period;
        int far = (int)fmin(lround(fmin(beats, INT16_MAX) * table->beat->bracket), shot);
        for (int shots = 1; shots <= SKIP_SHOTS; shots++)
            try_from(table, cell, event, shot, events, shots);
        for (int shots = MAX(far - 1, SKIP_SHOTS + 1); shots <= far + 1; shots++)
            try_from(table, cell, event, shot, events, shots);
    }
    cell->cost += other ? (float)LABEL : 0;
}

/* The cheapest end, and back from there. */
static void walk_back(const struct table *table)
{
    int count = (int)table->events->len, event = -1, shot = -1;
    float least = INFINITY;

    for (int e = 0; e < count; e++)
        for (int s = MAX(0, e - table->below); s < table->shots; s++) {
            const struct cell *cell = cell_at(table, e, s);
            if (!cell)
                break;
            float cost = cell->cost + (float)(OUTSIDE * (table->before[count] - table->before[e + 1]) +
                                              MISSING * (table->shots - 1 - s));
            if (cost < least) {
                least = cost;
                event = e;
                shot = s;
            }
        }
    while (event >= 0) {
        const struct cell *cell = cell_at(table, event, shot);
        g_array_index(table->events, struct shot_event, event).shot = shot;
        if (cell->events == 0)
            break;
        event -= cell->events;
        shot -= cell->shots;
    }
}

int shot_lay_events(GArray *events, int cameras, int shots, const struct shot_beat *beat, struct lumi_error *error)
{
    int count = (int)events->len, more = MAX(0, count - shots), fewer = MAX(0, shots - count);
    struct table table = {events, beat, shots, cameras, more + SLACK, more + fewer + 2 * SLACK + 1, NULL, NULL};

    if ((int64_t)count * table.width > CELLS_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT,
                         "%d moments at which cameras took pictures for %d shots: which are meant "
                         "cannot be told",
                         count, shots);
    table.cells = g_new(struct cell, (size_t)count * (size_t)table.width);
    table.before = g_new0(double, count + 1);
    for (int e = 0; e < count; e++)
        table.before[e + 1] = table.before[e] + (double)event_at(&table, e)->cameras / cameras;
    for (int e = 0; e < count; e++)
        for (int s = MAX(0, e - table.below); s < shots && s < e - table.below + table.width; s++)
            fill_cell(&table, e, s);
    walk_back(&table);
    g_free(table.cells);
    g_free(table.before);
    return LUMI_OK;
}
