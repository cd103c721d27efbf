/* What holds the arm: the brake, and what the switches on the string say.
 *
 * 1. The brake opens before anything moves, and not before the motor holds; it closes when the rig has come to rest. A
 *    rig whose arm is held keeps it closed always.
 * 2. The motor lets go only where a closed brake (or a held arm) has had the time to take over. */
#ifndef LUMI_FIRMWARE_CORE_DROP_STRING_H
#define LUMI_FIRMWARE_CORE_DROP_STRING_H

#include "firmware/board/board.h"

#include <stdbool.h>

struct core;

#define DROP_STRING_BRAKE_TICKS (BOARD_TICK_HZ / 4) /* a brake opens or closes in 250 ms */
#define DROP_STRING_REST_TICKS (BOARD_TICK_HZ / 2)  /* at rest so long: the brake closes */

struct drop_string {
    bool open;           /* the brake, as it was told */
    bool enabled;        /* the motor */
    bool off_wanted;     /* as soon as the brake holds */
    uint64_t brake_at;   /* tick of its last change */
    uint64_t enabled_at; /* since then the motor holds */
    uint64_t rest_at;    /* since then nothing moves */
    bool resting;
};

void drop_string_init(struct core *core);
/* Another profile: what holds now by it. */
void drop_string_configure(struct core *core);
/* Makes ready to move; true once it is. Asked until then. */
bool drop_string_ready(struct core *core);
/* The brake closes now. */
void drop_string_close(struct core *core);
/* The motor lets go as soon as the arm is held otherwise; where nothing else can hold it, it does not. */
void drop_string_release(struct core *core);
/* Something else than the motor holds the arm: the brake, for long enough, or it hangs on no string. */
bool drop_string_held(const struct core *core);
/* An external drive stops itself where its enable line falls: now. The brake closes, the position is lost. */
void drop_string_cut(struct core *core);
/* The bench's direct hand: false where it would let the arm fall. */
bool drop_string_set_enable(struct core *core, bool active);
bool drop_string_set_brake(struct core *core, bool open);
void drop_string_poll(struct core *core);
uint64_t drop_string_next_poll(const struct core *core);

#endif
