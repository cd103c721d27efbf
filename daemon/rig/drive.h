/* An industrial drive that turns the platform, told where to go by the host; and a start-stop sweep with it: the drive
 * moves, the board fires, watches the drive's position-reached line and owns its enable line, so that the emergency
 * stop stays in one hand. */
#ifndef LUMI_DAEMON_RIG_DRIVE_H
#define LUMI_DAEMON_RIG_DRIVE_H

#include "daemon/rig/drive_map.h"
#include "daemon/rig/link.h"
#include "proto/mechanism/sweep_plan.h"

struct lumi_rig_drive;

struct lumi_rig_drive_status {
    bool enabled, ready, reached, fault, homed; /* what the map has no bit for: ready and homed are true */
    bool position_known;
    double turns;  /* of the platform from step 0 */
    double counts; /* as the drive says it */
    int fault_code;
};

/* `address`: rtu:/dev/ttyUSB1[,baud=19200][,parity=E][,stop=1]  or  tcp:HOST[:502]. LUMI_ERR_ARG: no address;
 * LUMI_ERR_IO: it cannot be reached. */
int lumi_rig_drive_open(const char *address, const struct lumi_drive_map *map, struct lumi_rig_drive **drive,
                        struct lumi_error *error);
void lumi_rig_drive_close(struct lumi_rig_drive *drive);

/* Each takes at most (retries + 1) timeouts. The text says what the drive answered: an exception, nothing, a damaged
 * frame. */
int lumi_rig_drive_status(struct lumi_rig_drive *drive, struct lumi_rig_drive_status *status, struct lumi_error *error);
int lumi_rig_drive_go(struct lumi_rig_drive *drive, double turns, struct lumi_error *error);
int lumi_rig_drive_stop(struct lumi_rig_drive *drive, struct lumi_error *error);
int lumi_rig_drive_reset(struct lumi_rig_drive *drive, struct lumi_error *error);
int lumi_rig_drive_home(struct lumi_rig_drive *drive, struct lumi_error *error); /* begins it */
const struct lumi_drive_map *lumi_rig_drive_map(const struct lumi_rig_drive *drive);

/* ---- the sweep ---- */

struct lumi_rig_drive_sweep {
    struct lumi_rig_link *link;
    struct lumi_rig_drive *drive;
    const struct lumi_rig *rig;
    const struct lumi_plan *plan; /* loaded on the board already */
    uint32_t first_shot;          /* begins with the position of this one */
    const uint8_t *states; /* of every shot, 1: fired; positions with nothing else are passed by. NULL: none is */
    bool home;             /* the drive homes first */
    bool reset;            /* an alarm that the drive still has from before is reset */
    void *context;
    /* Every event of the board on the way (shots, faults). May be NULL. */
    void (*notice)(void *context, const struct lumi_rig_notice *notice);
    /* Asked between positions; true: stops there, LUMI_ERR_CANCELLED. May be NULL. */
    bool (*cancelled)(void *context);
    /* An emergency stop, asked at every look at a drive that moves, some fifty times a second; true: it is told to stop
     * at once, whether or not the board is there to say so as well; LUMI_ERR_CANCELLED. May be NULL. */
    bool (*stopped)(void *context);
    /* Filled in. */
    uint32_t fired, lost, next_shot;
};
/* LUMI_ERR_UNSUPPORTED: not a start-stop plan, or not a rig with an external drive. LUMI_ERR_BUSY: the board refuses,
 * a fault of its own or an alarm of the drive stands (somebody has to look), the drive is not enabled. LUMI_ERR_IO: the
 * drive is silent or did not get there. */
int lumi_rig_drive_sweep(struct lumi_rig_drive_sweep *sweep, struct lumi_error *error);

#endif
