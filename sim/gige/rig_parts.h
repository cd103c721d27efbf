/* The parts of a simulated rig, each the whole of a process. They return when their parent or the board has gone. */
#ifndef LUMI_SIM_GIGE_RIG_PARTS_H
#define LUMI_SIM_GIGE_RIG_PARTS_H

#include "sim/gige/rig_message.h"
#include "sim/gige/rig_processes.h"

#define RIG_EYES_MAX LUMI_RIG_CAMERAS

/* What a process tells its parent: that it is ready, or why not. */
struct rig_report {
    int code;
    double drawing; /* s, that the frames of a position take; of cameras */
    char text[1024];
};
void rig_report(int fd, int code, const struct lumi_error *error);
void rig_report_drawing(int fd, double seconds); /* ready */

/* `eyes`: a socket to each process of cameras; camera c belongs to number owner[c]. */
struct rig_board {
    const struct sim_rig_processes *rig;
    int report, life; /* pipes from and to the parent: `life` ends when it goes */
    int eyes[RIG_EYES_MAX], eye_count;
    int owner[LUMI_RIG_CAMERAS];
    int drive; /* a socket to its process; −1: the board turns the platform itself */
};
int rig_board_run(const struct rig_board *board, struct lumi_error *error);

struct rig_eyes {
    const struct sim_rig_processes *rig;
    int report, board;
    int first, count; /* its cameras */
};
int rig_eyes_run(const struct rig_eyes *eyes, struct lumi_error *error);

struct rig_drive {
    const struct sim_rig_processes *rig;
    int report, board;
};
int rig_drive_run(const struct rig_drive *drive, struct lumi_error *error);

/* Of the drive's counts, in its registers (lumi_drive_map_parse). */
#define RIG_DRIVE_COUNTS (-36000.0) /* a turn */
#define RIG_DRIVE_ZERO 500.0        /* at step 0, once it has homed */
#define RIG_DRIVE_SPEED 9000.0      /* a second, while nobody has said another */
extern const char rig_drive_map[];

/* All but the plan, which waits for what drawing turns out to take. */
int rig_plan_write(const struct sim_rig_processes *rig, struct lumi_error *error);
int rig_files_write(const struct sim_rig_processes *rig, struct lumi_error *error);

#endif
