/* Rig profiles and plans as messages, number for number. The lists below serve both directions, so that what goes out
 * comes back; tests/unit/test_wire_profile.c fills every field of the structs. */
#include "proto/base/bytes.h"
#include "proto/wire/message.h"

#include <assert.h>
#include <limits.h>
#include <pb_decode.h>
#include <pb_encode.h>
#include <string.h>

/* Fields that have one name on both sides: X(field). INTEGERS are not negative; NUMBERS are doubles, flags, and signed
 * integers, and are copied as they are. */
#define DRIVE_INTEGERS(X) X(motor_steps) X(microsteps) X(gear_motor) X(gear_platform) X(positions) X(turns)
#define DRIVE_NUMBERS(X) X(direction) X(index)
#define STRING_NUMBERS(X) X(held) X(length) X(per_turn) X(hold) X(anchor) X(hold_angle)
#define LENS_INTEGERS(X) X(width) X(height)
#define LENS_NUMBERS(X) X(fx) X(fy) X(cx) X(cy) X(k1) X(k2) X(k3) X(k4) X(p1) X(p2)
#define CAMERA_NUMBERS(X) X(angle) X(azimuth) X(radius) X(roll) X(pan) X(tilt)
#define TRIGGER_NUMBERS(X) X(channel) X(shutter_lag) X(pulse) X(focus_lead) X(focus_channel) X(busy) X(feedback)
#define UNCERTAINTY_NUMBERS(X) X(rotation) X(turn) X(drop)
#define MOTION_NUMBERS(X)                                                                                              \
    X(speed_max)                                                                                                       \
    X(acceleration_max)                                                                                                \
    X(jerk_max)                                                                                                        \
    X(home_speed) X(wind_speed) X(backlash) X(index_window) X(settle) X(step_pulse) X(direction_setup)
#define VIDEO_NUMBERS(X) X(record_pulse) X(record_lead) X(lamp_bit)
#define SAFETY_NUMBERS(X)                                                                                              \
    X(host_timeout)                                                                                                    \
    X(supply_minimum)                                                                                                  \
    X(overspeed) X(brake_fitted) X(slack_fitted) X(string_end_fitted) X(wound_fitted) X(driver_fault_fitted)
#define PLAN_INTEGERS(X) X(positions) X(first_turn) X(turns)
#define PLAN_NUMBERS(X) X(turn_time) X(position_time) X(settle) X(bracket_gap) X(cameras) X(blur_max)

#define COPY(field) to->field = from->field;
#define COPY_UNSIGNED(field) to->field = (uint32_t)from->field;
#define COPY_INTEGER(field) to->field = integer(from->field, INT_MAX, &sound);

/* The value, or 0 and *sound cleared if it is above `most`. */
static int integer(uint32_t value, uint32_t most, bool *sound)
{
    if (value > most) {
        *sound = false;
        return 0;
    }
    return (int)value;
}

/* Both fields have LUMI_RIG_NAME bytes and end. */
static void copy_name(char *to, const char *from)
{
    lumi_wire_copy_text(to, LUMI_RIG_NAME, from);
}

static void from_drive(const struct lumi_rig *from, lumi_wire_Drive *to)
{
    DRIVE_INTEGERS(COPY_UNSIGNED)
    DRIVE_NUMBERS(COPY)
}

static bool to_drive(const lumi_wire_Drive *from, struct lumi_rig *to)
{
    bool sound = true;

    DRIVE_INTEGERS(COPY_INTEGER)
    DRIVE_NUMBERS(COPY)
    return sound;
}

static void from_string(const struct lumi_rig_string *from, lumi_wire_String *to)
{
    STRING_NUMBERS(COPY)
    to->run = (uint32_t)from->run;
}

static bool to_string(const lumi_wire_String *from, struct lumi_rig_string *to)
{
    bool sound = true;

    STRING_NUMBERS(COPY)
    to->run = (enum lumi_rig_run)integer(from->run, LUMI_RIG_RUN_STRAIGHT, &sound);
    return sound;
}

static void from_lens(const struct lumi_lens *from, lumi_wire_Lens *to)
{
    LENS_INTEGERS(COPY_UNSIGNED)
    LENS_NUMBERS(COPY)
    to->model = (uint32_t)from->model;
}

static bool to_lens(const lumi_wire_Lens *from, struct lumi_lens *to)
{
    bool sound = true;

    LENS_INTEGERS(COPY_INTEGER)
    LENS_NUMBERS(COPY)
    to->model = (enum lumi_lens_model)integer(from->model, LUMI_LENS_EQUIRECTANGULAR, &sound);
    return sound;
}

static void from_camera(const struct lumi_rig_camera *from, lumi_wire_Camera *to)
{
    CAMERA_NUMBERS(COPY)
    to->lens = (uint32_t)from->lens;
    to->offset = from->offset_m;
}

static bool to_camera(const lumi_wire_Camera *from, struct lumi_rig_camera *to)
{
    bool sound = true;

    CAMERA_NUMBERS(COPY)
    to->lens = integer(from->lens, LUMI_RIG_LENSES - 1, &sound);
    to->offset_m = from->offset;
    return sound;
}

static void from_trigger(const struct lumi_rig_trigger *from, lumi_wire_Camera *to)
{
    TRIGGER_NUMBERS(COPY)
}

static void to_trigger(const lumi_wire_Camera *from, struct lumi_rig_trigger *to)
{
    TRIGGER_NUMBERS(COPY)
}

static void from_uncertainty(const struct lumi_rig_uncertainty *from, lumi_wire_Uncertainty *to)
{
    UNCERTAINTY_NUMBERS(COPY)
    to->position = from->position_m;
}

static void to_uncertainty(const lumi_wire_Uncertainty *from, struct lumi_rig_uncertainty *to)
{
    UNCERTAINTY_NUMBERS(COPY)
    to->position_m = from->position;
}

static void from_motion(const struct lumi_rig_motion *from, lumi_wire_Motion *to)
{
    MOTION_NUMBERS(COPY)
    to->drive = (uint32_t)from->drive;
}

static bool to_motion(const lumi_wire_Motion *from, struct lumi_rig_motion *to)
{
    bool sound = true;

    MOTION_NUMBERS(COPY)
    to->drive = (enum lumi_rig_drive_kind)integer(from->drive, LUMI_RIG_DRIVE_EXTERNAL, &sound);
    return sound;
}

static void from_video(const struct lumi_rig_video *from, lumi_wire_Video *to)
{
    VIDEO_NUMBERS(COPY)
}

static void to_video(const lumi_wire_Video *from, struct lumi_rig_video *to)
{
    VIDEO_NUMBERS(COPY)
}

static void from_safety(const struct lumi_rig_safety *from, lumi_wire_Safety *to)
{
    SAFETY_NUMBERS(COPY)
    to->reactions_count = LUMI_RIG_FAULTS;
    for (int i = 0; i < LUMI_RIG_FAULTS; i++) {
        to->reactions[i].motor = (uint32_t)from->reactions[i].motor;
        to->reactions[i].brake = from->reactions[i].brake;
        to->reactions[i].triggers = (uint32_t)from->reactions[i].triggers;
    }
}

static bool to_safety(const lumi_wire_Safety *from, struct lumi_rig_safety *to)
{
    bool sound = from->reactions_count == LUMI_RIG_FAULTS;

    SAFETY_NUMBERS(COPY)
    for (int i = 0; i < LUMI_RIG_FAULTS; i++) {
        const lumi_wire_Reaction *reaction = &from->reactions[i];

        to->reactions[i].motor = (enum lumi_rig_motor_reaction)integer(reaction->motor, LUMI_RIG_MOTOR_OFF, &sound);
        to->reactions[i].brake = reaction->brake;
        to->reactions[i].triggers =
            (enum lumi_rig_trigger_reaction)integer(reaction->triggers, LUMI_RIG_TRIGGERS_OFF, &sound);
    }
    return sound;
}

static_assert(sizeof(((lumi_wire_Safety *)0)->reactions) / sizeof(lumi_wire_Reaction) == LUMI_RIG_FAULTS,
              "a reaction to each fault");
static_assert(sizeof(((lumi_wire_Profile *)0)->cameras) / sizeof(lumi_wire_Camera) == LUMI_RIG_CAMERAS, "cameras fit");
static_assert(sizeof(((lumi_wire_Profile *)0)->lenses) / sizeof(lumi_wire_Lens) == LUMI_RIG_LENSES, "lenses fit");
static_assert(sizeof(((lumi_wire_Profile *)0)->name) == LUMI_RIG_NAME, "names fit");
static_assert(sizeof(((lumi_wire_Plan *)0)->exposures) / sizeof(double) == LUMI_PLAN_BRACKET, "exposures fit");

size_t lumi_wire_encode_profile(const struct lumi_rig *rig, lumi_wire_Profile *scratch, uint8_t *data, size_t size)
{
    pb_ostream_t stream = pb_ostream_from_buffer(data, size);

    if (rig->camera_count < 0 || rig->camera_count > LUMI_RIG_CAMERAS || rig->lens_count < 0 ||
        rig->lens_count > LUMI_RIG_LENSES)
        return 0;
    memset(scratch, 0, sizeof *scratch);
    scratch->version = LUMI_WIRE_PROFILE_VERSION;
    copy_name(scratch->name, rig->name);
    scratch->has_drive = scratch->has_string = scratch->has_uncertainty = true;
    scratch->has_motion = scratch->has_video = scratch->has_safety = true;
    from_drive(rig, &scratch->drive);
    from_string(&rig->string, &scratch->string);
    scratch->lenses_count = (pb_size_t)rig->lens_count;
    for (int i = 0; i < rig->lens_count; i++) {
        copy_name(scratch->lenses[i].name, rig->lenses[i].name);
        from_lens(&rig->lenses[i].lens, &scratch->lenses[i]);
    }
    scratch->cameras_count = (pb_size_t)rig->camera_count;
    for (int i = 0; i < rig->camera_count; i++) {
        copy_name(scratch->cameras[i].name, rig->cameras[i].name);
        from_camera(&rig->cameras[i], &scratch->cameras[i]);
        from_trigger(&rig->control.triggers[i], &scratch->cameras[i]);
    }
    from_uncertainty(&rig->uncertainty, &scratch->uncertainty);
    from_motion(&rig->control.motion, &scratch->motion);
    from_video(&rig->control.video, &scratch->video);
    from_safety(&rig->control.safety, &scratch->safety);
    return pb_encode(&stream, lumi_wire_Profile_fields, scratch) ? stream.bytes_written : 0;
}

#define REFUSE(...) return lumi_fail(error, LUMI_ERR_FORMAT, __VA_ARGS__)

static int to_rig(lumi_wire_Profile *from, struct lumi_rig *rig, struct lumi_error *error)
{
    if (!from->has_drive || !from->has_string || !from->has_uncertainty || !from->has_motion || !from->has_video ||
        !from->has_safety)
        REFUSE("the profile lacks a part");
    lumi_wire_clean_text(from->name, sizeof from->name);
    copy_name(rig->name, from->name);
    if (!to_drive(&from->drive, rig))
        REFUSE("a number of the drive is too large");
    if (!to_string(&from->string, &rig->string))
        REFUSE("a string that runs in an unknown way (%u)", (unsigned)from->string.run);
    rig->lens_count = (int)from->lenses_count;
    for (int i = 0; i < rig->lens_count; i++) {
        copy_name(rig->lenses[i].name, from->lenses[i].name);
        if (!to_lens(&from->lenses[i], &rig->lenses[i].lens))
            REFUSE("lens %d is of an unknown kind, or too large", i);
    }
    rig->camera_count = (int)from->cameras_count;
    lumi_rig_control_init(&rig->control); /* of cameras that there are not */
    for (int i = 0; i < rig->camera_count; i++) {
        copy_name(rig->cameras[i].name, from->cameras[i].name);
        if (!to_camera(&from->cameras[i], &rig->cameras[i]))
            REFUSE("camera %d has a lens that there cannot be (%u)", i, (unsigned)from->cameras[i].lens);
        to_trigger(&from->cameras[i], &rig->control.triggers[i]);
    }
    to_uncertainty(&from->uncertainty, &rig->uncertainty);
    if (!to_motion(&from->motion, &rig->control.motion))
        REFUSE("a drive of an unknown kind (%u)", (unsigned)from->motion.drive);
    to_video(&from->video, &rig->control.video);
    if (!to_safety(&from->safety, &rig->control.safety))
        REFUSE("reactions to faults: %u wanted, of known kinds", (unsigned)LUMI_RIG_FAULTS);
    return LUMI_OK;
}

int lumi_wire_decode_profile(const uint8_t *data, size_t size, lumi_wire_Profile *scratch, struct lumi_rig *rig,
                             struct lumi_error *error)
{
    pb_istream_t stream = pb_istream_from_buffer(data, size);

    memset(scratch, 0, sizeof *scratch);
    memset(rig, 0, sizeof *rig);
    if (!pb_decode(&stream, lumi_wire_Profile_fields, scratch))
        REFUSE("not a profile, or one with more cameras, lenses or reactions than there can be");
    if (scratch->version == 0)
        REFUSE("not a profile");
    if (scratch->version > LUMI_WIRE_PROFILE_VERSION)
        return lumi_fail(error, LUMI_ERR_VERSION, "a profile of version %u; this program knows up to %u",
                         (unsigned)scratch->version, (unsigned)LUMI_WIRE_PROFILE_VERSION);
    return to_rig(scratch, rig, error);
}

void lumi_wire_from_plan(const struct lumi_plan *from, lumi_wire_Plan *to)
{
    memset(to, 0, sizeof *to);
    copy_name(to->name, from->name);
    to->mode = (uint32_t)from->mode;
    to->wind = (uint32_t)from->wind;
    PLAN_INTEGERS(COPY_UNSIGNED)
    PLAN_NUMBERS(COPY)
    to->exposures_count = from->bracket < 0                   ? 0
                          : from->bracket > LUMI_PLAN_BRACKET ? LUMI_PLAN_BRACKET
                                                              : (pb_size_t)from->bracket;
    for (pb_size_t i = 0; i < to->exposures_count; i++)
        to->exposures[i] = from->exposures[i];
}

int lumi_wire_to_plan(const lumi_wire_Plan *from, struct lumi_plan *to, struct lumi_error *error)
{
    bool sound = true;

    memset(to, 0, sizeof *to);
    if (from->mode > LUMI_PLAN_VIDEO)
        REFUSE("a plan of an unknown kind (%u)", (unsigned)from->mode);
    if (from->wind > LUMI_PLAN_WIND_NONE)
        REFUSE("an unknown way to wind up (%u)", (unsigned)from->wind);
    copy_name(to->name, from->name);
    to->mode = (enum lumi_plan_mode)from->mode;
    to->wind = (enum lumi_plan_wind)from->wind;
    PLAN_INTEGERS(COPY_INTEGER)
    PLAN_NUMBERS(COPY)
    if (!sound)
        REFUSE("a number of the plan is too large");
    to->bracket = (int)from->exposures_count;
    for (int i = 0; i < to->bracket; i++)
        to->exposures[i] = from->exposures[i];
    return LUMI_OK;
}

uint32_t lumi_wire_plan_crc(const struct lumi_plan *plan)
{
    uint8_t data[lumi_wire_Plan_size];
    lumi_wire_Plan message;
    pb_ostream_t stream = pb_ostream_from_buffer(data, sizeof data);

    lumi_wire_from_plan(plan, &message);
    return pb_encode(&stream, lumi_wire_Plan_fields, &message) ? lumi_crc32c(0, data, stream.bytes_written) : 0;
}

bool lumi_wire_profile_request(const uint8_t *data, size_t size, size_t *at, lumi_wire_Request *request)
{
    lumi_wire_WriteProfile *part = &request->command.write_profile;
    lumi_wire_CommitProfile *commit = &request->command.commit_profile;

    if (*at > size)
        return false;
    memset(request, 0, sizeof *request);
    if (*at == size) {
        request->which_command = lumi_wire_Request_commit_profile_tag;
        commit->size = (uint32_t)size;
        commit->crc = lumi_crc32c(0, data, size);
        *at = size + 1;
        return true;
    }
    size_t take = size - *at < sizeof part->data.bytes ? size - *at : sizeof part->data.bytes;
    request->which_command = lumi_wire_Request_write_profile_tag;
    part->offset = (uint32_t)*at;
    part->data.size = (pb_size_t)take;
    memcpy(part->data.bytes, data + *at, take);
    *at += take;
    return true;
}
