/* The register map of an industrial drive: which Modbus registers hold what, and what a turn is there. Text
 * (docs/rig-drive.md). */
#ifndef LUMI_DAEMON_RIG_DRIVE_MAP_H
#define LUMI_DAEMON_RIG_DRIVE_MAP_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_DRIVE_MAP_NAME 32
#define LUMI_DRIVE_MAP_TEXT_MAX 16384

/* A number that can be read or written. */
struct lumi_drive_register {
    bool used;
    int address;       /* 0 … 65535, as in the protocol (a manual's 40001 is 0) */
    bool input;        /* an input register (function 4), not a holding register (3) */
    int width;         /* 16, or 32: two registers */
    double multiplier; /* what it says, times this, is the value in the map's unit */
};

/* A bit of the status word; inverted where it means the opposite while set. */
struct lumi_drive_bit {
    bool used, inverted;
    int bit;
};

/* Something that is told by writing a value, and then, where the drive goes by edges, another. */
struct lumi_drive_command {
    bool used;
    int address;
    int value;
    int clear; /* −1: nothing is written afterwards */
};

struct lumi_drive_map {
    char name[LUMI_DRIVE_MAP_NAME];
    int unit;               /* of the drive on the bus: 1 … 247 */
    double timeout;         /* s, for one answer */
    int retries;            /* after one that did not come or was damaged */
    bool low_word_first;    /* of 32 bits */
    double counts_per_turn; /* of the platform; negative: rising counts turn the other way */
    double zero_counts;     /* where the platform is at step 0 */
    double tolerance;       /* counts: nearer than this is there */
    double move_timeout;    /* s, for a move from one position to the next; and for homing */
    double home_timeout;
    struct lumi_drive_register status, position, fault_code, target, speed;
    double speed_counts_per_s; /* what is written to `speed` before every start; 0: nothing */
    struct lumi_drive_bit enabled, ready, reached, fault, homed;
    struct lumi_drive_command start, stop, reset, home;
};

/* LUMI_ERR_FORMAT names `source` and the line. Wants status (with the bits enabled, reached and fault), position,
 * target and start. */
int lumi_drive_map_parse(const char *text, size_t size, const char *source, struct lumi_drive_map *map,
                         struct lumi_error *error);

#endif
