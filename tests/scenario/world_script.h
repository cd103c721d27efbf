/* What goes wrong in a world, and when: seeded scripts of faults, each undone after a while. */
#ifndef LUMI_TESTS_SCENARIO_WORLD_SCRIPT_H
#define LUMI_TESTS_SCENARIO_WORLD_SCRIPT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct world;

enum world_fault_kind {
    WORLD_FAULT_UNPLUG_CAMERA = 0,
    WORLD_FAULT_DROP,   /* its next frames are lost on the way; the camera's count says so */
    WORLD_FAULT_VANISH, /* it does not see its next triggers */
    WORLD_FAULT_LATE,
    WORLD_FAULT_DOUBLE,
    WORLD_FAULT_SWAP, /* arrives after the one behind it */
    WORLD_FAULT_DAMAGE,
    WORLD_FAULT_BLUR,
    WORLD_FAULT_EXPOSURE,
    WORLD_FAULT_STALL, /* nothing of it arrives for a while, then everything */
    WORLD_FAULT_SPURIOUS,
    WORLD_FAULT_SYNC_MISSING,
    WORLD_FAULT_SYNC_EXTRA,
    WORLD_FAULT_BOARD_RESET,
    WORLD_FAULT_BOARD_POWER,
    WORLD_FAULT_LINK_CUT,
    WORLD_FAULT_LINK_NOISE,
    WORLD_FAULT_LINK_UNPLUG,
    WORLD_FAULT_ESTOP,
    WORLD_FAULT_DISK_FULL,
    WORLD_FAULT_DISK_SLOW,
    WORLD_FAULT_DISK_ERROR,
    WORLD_FAULT_CLOCK_STEP,
    WORLD_FAULT_HANG,
    WORLD_FAULT_KILL,
    WORLD_FAULT_KILL_STORING, /* inside the store, before a file */
    WORLD_FAULT_PAUSE,
    WORLD_FAULT_KINDS
};
extern const char *const world_fault_names[WORLD_FAULT_KINDS];

struct world_fault {
    enum world_fault_kind kind;
    int shot;  /* when so many shots have been fired for the first time; −1: by time */
    double at; /* s, since the shot or since the script was given to the world */
    int camera, count;
    double value, duration;
    /* of its run */
    int64_t due_ns; /* 0: waits for its shot; INT64_MAX: over */
    bool on;
};

#define WORLD_FAULTS_MAX 16
struct world_script {
    int count;
    struct world_fault faults[WORLD_FAULTS_MAX];
    uint64_t happened; /* bit a kind */
};

void world_script_random(struct world_script *script, uint64_t seed, int most, int shots, int cameras);
size_t world_script_print(const struct world_script *script, char *text, size_t size);
/* What is due now happens. */
void world_script_service(struct world *world);
int64_t world_script_next(const struct world *world);

#endif
