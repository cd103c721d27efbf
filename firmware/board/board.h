/* What the firmware's core asks of a board: clock, step timer, trigger outputs, inputs, links, flash. A port fills one
 * struct; the core never sees a register.
 *
 * 1. Time is counted in ticks of BOARD_TICK_HZ from a start that `now` defines; 64 bits never wrap.
 * 2. Two levels: the core's interrupt entries (core.h, "from interrupts") are called by the port with interrupts that
 *    can be held off by `lock`; everything else runs in the main loop. A port without interrupts (virtual time) calls
 *    them between two calls of core_poll.
 * 3. Every port makes edges exact: a step or trigger is at its tick as far as the hardware can. */
#ifndef LUMI_FIRMWARE_BOARD_BOARD_H
#define LUMI_FIRMWARE_BOARD_BOARD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define BOARD_TICK_HZ 84000000u
#define BOARD_NEVER UINT64_MAX

enum board_input {
    BOARD_IN_ESTOP = 0,  /* active: pressed, or its wire broken (normally closed) */
    BOARD_IN_INDEX,      /* active: the platform's mark is under the switch */
    BOARD_IN_SLACK,      /* active: the string hangs loose */
    BOARD_IN_STRING_END, /* active: the string is paid out */
    BOARD_IN_WOUND,      /* active: the arm is all the way up */
    BOARD_IN_DRIVER_FAULT,
    BOARD_IN_REACHED, /* external drive: it stands at its target */
    BOARD_INPUTS
};
enum board_output {
    BOARD_OUT_ENABLE = 0, /* motor driver (or external drive) energised */
    BOARD_OUT_BRAKE,      /* active: the brake is OPEN (so that it closes without power) */
    BOARD_OUT_LAMP,
    BOARD_OUT_STATUS,
    BOARD_OUTPUTS
};
enum board_link { BOARD_LINK_SERIAL = 0, BOARD_LINK_USB, BOARD_LINKS };
enum board_reset { BOARD_RESET_POWER = 0, BOARD_RESET_PIN, BOARD_RESET_SOFTWARE, BOARD_RESET_WATCHDOG };

#define BOARD_UNIQUE_ID 12
#define BOARD_PROFILE_SLOTS 2
#define BOARD_PROFILE_SLOT_SIZE 16384 /* bytes; a slot is erased as a whole */

struct board {
    const char *name; /* what the host is told it talks to: "stm32f405", "host" */
    void *port;

    uint64_t (*now)(void *port);
    /* Holds the core's interrupts off / lets them in again; nests. */
    unsigned (*lock)(void *port);
    void (*unlock)(void *port, unsigned state);

    /* Steps. Pulse 0 rises at tick `at`, pulse 1 `first` ticks later (0: there is no pulse 1). At every pulse k the
     * port calls core_on_step, which returns the ticks from pulse k + 1 to pulse k + 2 (0: pulse k + 1 is the last), so
     * that a timer with a preloaded period has it a whole period early. `forward` sets the direction pin at once. */
    void (*steps_start)(void *port, uint64_t at, bool forward, uint32_t first);
    /* Not one pulse more that has not begun to rise. Callable from interrupts, as output is. */
    void (*steps_stop)(void *port);
    void (*step_pulse_width)(void *port, uint32_t ticks);

    /* Triggers: at tick `at` (or at once, if that has passed) the trigger outputs become `lines`, bit 0 channel 0; then
     * the port calls core_on_trigger. One is pending at a time. Lateness is what core_on_trigger is told. */
    void (*trigger_at)(void *port, uint64_t at, uint16_t lines);
    void (*trigger_cancel)(void *port);                /* nothing is pending any more; outputs stay as they are */
    void (*trigger_lines)(void *port, uint16_t lines); /* at once; callable from interrupts */

    bool (*input)(void *port, enum board_input input); /* true: active */
    void (*output)(void *port, enum board_output output, bool active);
    bool (*feedback)(void *port, int input);
    int (*supply_mv)(void *port);
    enum board_reset (*reset_cause)(void *port);
    void (*watchdog_kick)(void *port);
    void (*unique_id)(void *port, uint8_t id[BOARD_UNIQUE_ID]);
    /* Another number after every restart, as far as the board can make one (its noise source). Asked once. */
    uint32_t (*boot_number)(void *port);

    /* Bytes of a link; never block; return how many were taken. `link_up`: somebody is there, as far as one can tell.
     */
    size_t (*link_read)(void *port, enum board_link link, uint8_t *data, size_t size);
    size_t (*link_write)(void *port, enum board_link link, const uint8_t *data, size_t size);
    bool (*link_up)(void *port, enum board_link link);

    /* Flash for the profile. Offsets and sizes are multiples of 4; erased bytes read 0xff. False: the hardware refused.
     * May take long (an erase up to seconds): only called while nothing moves. */
    bool (*flash_erase)(void *port, int slot);
    bool (*flash_write)(void *port, int slot, uint32_t offset, const void *data, size_t size);
    const uint8_t *(*flash_map)(void *port, int slot);

    /* Leaves the firmware for the chip's own loader (DFU); does not return on hardware. */
    void (*enter_loader)(void *port);
    void (*restart)(void *port);
};

#endif
