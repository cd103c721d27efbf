/* One direction of a link between board and host in virtual time: bytes arrive in order after a delay, at a rate, and
 * not always as they were sent. */
#ifndef LUMI_SIM_RIG_WIRE_PATH_H
#define LUMI_SIM_RIG_WIRE_PATH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <glib.h>

struct sim_wire_path {
    uint64_t seed;
    uint64_t delay; /* ticks a byte takes at least */
    double rate;    /* bytes/s */
    double noise;   /* share of the packets that are damaged: a byte changed, lost, doubled, or all of them lost */
    bool cut;       /* nothing gets through, and what is under way is lost */
    uint64_t free_at, sent, damaged; /* when the line is free again; packets so far */
    GQueue packets;
};
void sim_wire_path_init(struct sim_wire_path *path, uint64_t seed, double delay_seconds, double bytes_per_second);
void sim_wire_path_finish(struct sim_wire_path *path);
void sim_wire_path_send(struct sim_wire_path *path, uint64_t now, const uint8_t *data, size_t size);
/* When the next bytes arrive, or UINT64_MAX. */
uint64_t sim_wire_path_next(const struct sim_wire_path *path);
/* The next packet that has arrived by `now`, or NULL (transfer full). */
GBytes *sim_wire_path_take(struct sim_wire_path *path, uint64_t now);
void sim_wire_path_clear(struct sim_wire_path *path);

#endif
