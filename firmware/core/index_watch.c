/* Whether index marks come where they should. */
#include "firmware/core/index_watch.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>

/* A window is missed so long after it was left: an edge at its end may still be bouncing. */
#define PATIENCE (4 * DEBOUNCE_TICKS)

void index_watch_begin(struct index_watch *watch, const struct lumi_rig *rig, int64_t position, bool closed)
{
    watch->steps_per_turn = lumi_rig_steps_per_turn(rig);
    watch->window = rig->control.motion.index_window / (2 * LUMI_PI) * watch->steps_per_turn;
    /* The first turn whose window begins after here. */
    watch->next = (int64_t)floor(((double)position + watch->window) / watch->steps_per_turn) + 1;
    watch->left_at = 0;
    debounce_init(&watch->input, closed);
    watch->active = watch->window > 0;
}

void index_watch_end(struct index_watch *watch)
{
    watch->active = false;
}

void index_watch_on_input(struct index_watch *watch, bool closed, int64_t position, uint64_t at)
{
    if (watch->active)
        debounce_input(&watch->input, closed, position, at);
}

static bool window_left(const struct index_watch *watch, int64_t position)
{
    return (double)position > (double)watch->next * watch->steps_per_turn + watch->window;
}

enum index_verdict index_watch_edge(struct index_watch *watch, int64_t position)
{
    double s = watch->steps_per_turn;
    int64_t turn = (int64_t)floor((double)position / s + 0.5);

    if (!watch->active)
        return INDEX_OK;
    if (fabs((double)position - (double)turn * s) > watch->window)
        return INDEX_EARLY;
    if (turn >= watch->next) {
        watch->next = turn + 1;
        watch->left_at = 0;
    }
    return INDEX_OK;
}

enum index_verdict index_watch_position(struct index_watch *watch, int64_t position)
{
    if (!watch->active || !window_left(watch, position))
        return INDEX_OK;
    watch->next++;
    watch->left_at = 0;
    return INDEX_MISSED;
}

enum index_verdict index_watch_poll(struct index_watch *watch, const struct board *board, int64_t position,
                                    uint64_t now)
{
    struct debounce_edge edge = {0};

    if (!watch->active)
        return INDEX_OK;
    unsigned state = board->lock(board->port);
    debounce_input(&watch->input, board->input(board->port, BOARD_IN_INDEX), position, now); /* were one lost */
    bool changed = debounce_poll(&watch->input, now, &edge);
    bool bouncing = watch->input.bouncing;
    board->unlock(board->port, state);

    if (changed && edge.active)
        return index_watch_edge(watch, edge.position);
    if (watch->left_at == 0 && window_left(watch, position))
        watch->left_at = now;
    if (watch->left_at == 0 || bouncing || now < watch->left_at + PATIENCE)
        return INDEX_OK;
    return index_watch_position(watch, position);
}
