/* An industrial drive that is none: libmodbus' own server with registers that move, over a pseudo-terminal or TCP, and
 * what such a drive does wrong. Moves by being asked, not by the clock: it is there after so many looks. */
#ifndef LUMI_TESTS_UNIT_FAKE_DRIVE_H
#define LUMI_TESTS_UNIT_FAKE_DRIVE_H

#include <modbus/modbus.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#define FAKE_DRIVE_MAP                                                                                                 \
    "[drive]\nname = fake\nunit = 3\ntimeout_s = 0.3\nretries = 2\nmove_timeout_s = 1.5\nhome_timeout_s = 1.5\n"       \
    "[scale]\ncounts_per_turn = -36000\nzero_counts = 500\ntolerance_counts = 2\n"                                     \
    "[status]\naddress = 0\nready = 0\nenabled = 1\nreached = !2\nfault = 3\nhomed = 4\n"                              \
    "[fault-code]\naddress = 1\n[position]\naddress = 2\nwidth = 32\n"                                                 \
    "[target]\naddress = 0x0A\nwidth = 32\n[speed]\naddress = 16\nwidth = 32\ncounts_per_s = 9000\n"                   \
    "[start]\naddress = 12\nvalue = 1\nclear = 0\n[stop]\naddress = 13\nvalue = 1\nclear = 0\n"                        \
    "[reset]\naddress = 14\nvalue = 0xff\nclear = 0\n[home]\naddress = 15\nvalue = 1\nclear = 0\n"

struct fake_drive {
    pthread_mutex_t lock;
    /* With the lock held. */
    bool enabled, fault, homed, stuck;
    int fault_code;
    int moves, stops, resets, requests;
    int silent, damaged, exceptions; /* so many of the next answers */
    int exception;                   /* which */
    int fault_at_move;               /* this move (from 1) ends in fault 42 */
    bool hang_up;                    /* TCP: closes the connection at the next request */

    char address[128];
    /* Its own. */
    modbus_t *bus;
    modbus_mapping_t *registers;
    int listener, fd, keep;
    bool tcp, ending;
    int32_t position, target;
    int looks; /* until it is there */
    pthread_t thread;
};

void fake_drive_start(struct fake_drive *drive, bool tcp);
void fake_drive_stop(struct fake_drive *drive);
bool fake_drive_reached(struct fake_drive *drive);
int32_t fake_drive_position(struct fake_drive *drive);

#endif
