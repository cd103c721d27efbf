/* The rig profile: what a rotating rig is made of, in numbers, and where that puts every camera at any step and turn.
 *
 * The rig: a platform turns about the world's +Z. On it an arm pivots in a vertical plane through the axis; the arm
 * carries the cameras. A camera's place on the arm is an angle in that plane: 0 points outwards along the platform's
 * direction, 90° up the axis, 180° to the other side. The arm hangs on a string wound round a rod that stands still, so
 * that each turn pays out the rod's circumference and every arm angle falls by the same amount ("the drop"); or a brake
 * holds the arm. Overbeck et al. 2018, section 3.
 *
 * No heap, no files: firmware uses this code too. */
#ifndef LUMI_PROTO_MECHANISM_RIG_H
#define LUMI_PROTO_MECHANISM_RIG_H

#include "proto/base/lens.h"
#include "proto/base/result.h"
#include "proto/mechanism/control.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_RIG_CAMERAS 16
#define LUMI_RIG_LENSES 4
#define LUMI_RIG_NAME 32
#define LUMI_RIG_POSITIONS_MAX 4096
#define LUMI_RIG_TURNS_MAX 256

struct lumi_rig_lens {
    char name[LUMI_RIG_NAME];
    struct lumi_lens lens;
};

struct lumi_rig_camera {
    char name[LUMI_RIG_NAME];
    int lens;        /* index into lenses */
    double angle;    /* on the arm, where the sweep starts; see above. −π .. 2π */
    double azimuth;  /* of its arm against the platform's direction (several arms: several azimuths) */
    double radius;   /* of its centre of projection from the pivot */
    double roll;     /* about the optical axis; 0: the image's top towards rising arm angles */
    double pan;      /* mounting, about the image's down axis; 0 looks radially outwards */
    double tilt;     /* mounting, about the image's right axis; positive looks up */
    double offset_m; /* of the centre of projection across the arm's plane, towards the image's right at roll 0 */
};

enum lumi_rig_run { LUMI_RIG_RUN_ARC = 0, LUMI_RIG_RUN_STRAIGHT = 1 };

/* The drop. Run "arc": the string lies along the arc that its hold describes, so the drop is paid / hold. Run
 * "straight": it leaves the rod at height `anchor` above the pivot, on the axis, and goes straight to the hold, `hold`
 * from the pivot at the arm angle `hold_angle` when the sweep starts; the law of cosines gives the drop. */
struct lumi_rig_string {
    bool held; /* a brake holds the arm: no drop */
    enum lumi_rig_run run;
    double length;     /* of the whole string, metres */
    double per_turn;   /* paid out each turn, metres: the rod's circumference */
    double hold;       /* from the pivot to where the string holds the arm */
    double anchor;     /* straight only */
    double hold_angle; /* straight only */
};

/* One standard deviation of what the profile does not know. */
struct lumi_rig_uncertainty {
    double position_m; /* of a centre of projection */
    double rotation;   /* of a camera's orientation */
    double turn;       /* of the platform's angle */
    double drop;       /* of the arm's angle */
};

struct lumi_rig {
    char name[LUMI_RIG_NAME];
    int camera_count, lens_count;
    struct lumi_rig_camera cameras[LUMI_RIG_CAMERAS];
    struct lumi_rig_lens lenses[LUMI_RIG_LENSES];
    /* Drive: a platform turn is gear_motor / gear_platform motor turns. */
    int motor_steps; /* full steps a motor turn */
    int microsteps;
    int gear_motor, gear_platform;
    int direction; /* +1: rising steps turn the platform counter-clockwise seen from above, −1: clockwise */
    double index;  /* the platform's direction at step 0, from the index mark */
    /* The sweep the rig is meant for. */
    int positions; /* a turn */
    int turns;
    struct lumi_rig_string string;
    struct lumi_rig_uncertainty uncertainty;
    struct lumi_rig_control control; /* limits, wiring, reactions: for the board */
};

/* 16 cameras × 72 positions on a sphere of 70 cm, 110° × 88°, one turn with the arm held ("arc16"); the same with the
 * string, two turns, 32 rows ("arc16x2"); two fisheyes on a bar of 80 cm, 120° × 96°, 18 turns of 3 cm ("bar2"). */
int lumi_rig_builtin(const char *name, struct lumi_rig *rig, struct lumi_error *error);
extern const char *const lumi_rig_builtin_names[]; /* NULL-terminated */

/* The same mechanisms in other numbers: an arc of `cameras` evenly spread from pole to pole (none at a pole), and where
 * turns > 1 on the string, falling by their spacing in all turns together; a bar of two cameras, the first from above
 * down to the equator, the second from below up to it, `drop_m` of arc a turn. Equidistant lenses of the given size and
 * field of view. LUMI_ERR_ARG as lumi_rig_check. */
int lumi_rig_arc(struct lumi_rig *rig, int cameras, int positions, int turns, double radius, int width, int height,
                 double fov_x, double fov_y, struct lumi_error *error);
int lumi_rig_bar(struct lumi_rig *rig, int positions, int turns, double radius, double drop_m, int width, int height,
                 double fov_x, double fov_y, struct lumi_error *error);

/* Whether such a rig can be: LUMI_ERR_FORMAT with the reason (zero ratio, string too short for its turns, …). */
int lumi_rig_check(const struct lumi_rig *rig, struct lumi_error *error);

/* The text form (docs/rig-profile.md). Parsing trusts nothing, wants a whole profile, and ends with lumi_rig_check;
 * errors name `source` and the line. */
int lumi_rig_parse(const char *text, size_t size, const char *source, struct lumi_rig *rig, struct lumi_error *error);
/* Writes at most `size` bytes, the last of them 0, and returns the length of the whole text, so that 0 bytes measure.
 * What it writes parses to the same numbers, bit for bit. */
size_t lumi_rig_print(const struct lumi_rig *rig, char *text, size_t size);
#define LUMI_RIG_TEXT_MAX 16384 /* longest text lumi_rig_print makes or lumi_rig_parse takes */

#ifdef __cplusplus
}
#endif
#endif
