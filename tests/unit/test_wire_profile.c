/* proto/wire: the rig profile and the plan as messages lose no number; what the structs cannot hold is refused. */
#include "proto/wire/message.h"

#include <math.h>
#include <pb_encode.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Bytes of padding in the structs, where doubles are aligned to 8 and enums and ints have 4 bytes. */
#define LENS_PADDING (LUMI_RIG_LENSES * 4)
#define CAMERA_PADDING (LUMI_RIG_CAMERAS * (4 + 12)) /* with its trigger */
#define SAFETY_PADDING (3 + LUMI_RIG_FAULTS * 3 + 4)
#define PADDING (LENS_PADDING + CAMERA_PADDING + SAFETY_PADDING + 4 + 3 + 4) /* drive, string, motion */
#define PLAN_PADDING 12

static lumi_wire_Profile scratch;
static uint8_t data[LUMI_WIRE_PROFILE_MAX];

static void name(char *field, const char *text)
{
    memset(field, 0, LUMI_RIG_NAME);
    strcpy(field, text);
}

/* Every byte is 1 (an int, a double, a flag that are not zero), but where only some values can be. */
static void fill(struct lumi_rig *rig)
{
    memset(rig, 1, sizeof *rig);
    name(rig->name, "full");
    rig->lens_count = LUMI_RIG_LENSES;
    rig->camera_count = LUMI_RIG_CAMERAS;
    for (int i = 0; i < LUMI_RIG_LENSES; i++) {
        name(rig->lenses[i].name, "lens-of-a-name-of-31-characters");
        rig->lenses[i].lens.model = i % 2 ? LUMI_LENS_FISHEYE : LUMI_LENS_BROWN;
    }
    for (int i = 0; i < LUMI_RIG_CAMERAS; i++) {
        name(rig->cameras[i].name, "camera");
        rig->cameras[i].lens = 1 + i % 3;
    }
    rig->string.run = LUMI_RIG_RUN_STRAIGHT;
    rig->control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    for (int i = 0; i < LUMI_RIG_FAULTS; i++) {
        rig->control.safety.reactions[i].motor = i % 2 ? LUMI_RIG_MOTOR_HALT : LUMI_RIG_MOTOR_OFF;
        rig->control.safety.reactions[i].triggers = LUMI_RIG_TRIGGERS_OFF;
    }
}

static void every_field_of_the_profile_comes_back(void **state)
{
    struct lumi_rig rig, back;
    size_t lost = 0;

    (void)state;
    fill(&rig);
    size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
    assert_true(size > 0);
    assert_int_equal(lumi_wire_decode_profile(data, size, &scratch, &back, NULL), LUMI_OK);
    for (size_t i = 0; i < sizeof rig; i++)
        lost += ((const uint8_t *)&rig)[i] != ((const uint8_t *)&back)[i];
    /* What did not come back is padding: a new field that the messages forget adds to it. */
    assert_int_equal(lost, PADDING);
}

static void the_rigs_there_are_come_back_and_are_sound(void **state)
{
    static char before[LUMI_RIG_TEXT_MAX], after[LUMI_RIG_TEXT_MAX];
    struct lumi_error error;
    struct lumi_rig rig, back;

    (void)state;
    for (int n = 0; lumi_rig_builtin_names[n]; n++) {
        assert_int_equal(lumi_rig_builtin(lumi_rig_builtin_names[n], &rig, NULL), LUMI_OK);
        size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
        assert_int_equal(lumi_wire_decode_profile(data, size, &scratch, &back, NULL), LUMI_OK);
        assert_int_equal(lumi_rig_check(&back, &error), LUMI_OK);
        lumi_rig_print(&rig, before, sizeof before);
        lumi_rig_print(&back, after, sizeof after);
        assert_string_equal(before, after);
        for (int i = rig.camera_count; i < LUMI_RIG_CAMERAS; i++) /* of none: as it was before anything was said */
            assert_int_equal(back.control.triggers[i].channel, rig.control.triggers[i].channel);
    }
}

static void a_projection_is_no_lens(void **state)
{
    struct lumi_error error = {0};
    struct lumi_rig rig, back;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    rig.lenses[0].lens.model = LUMI_LENS_EQUIRECTANGULAR; /* the text form has no word for it */
    size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
    assert_int_equal(lumi_wire_decode_profile(data, size, &scratch, &back, NULL), LUMI_OK);
    assert_int_equal(lumi_rig_check(&back, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "projection"));
}

static void numbers_of_every_kind_come_back_bit_for_bit(void **state)
{
    const double odd[] = {-0.0, 5e-324, 1.7976931348623157e308, 0.1, -1.0 / 3.0, NAN, INFINITY, -INFINITY};
    struct lumi_rig rig, back;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        rig.index = rig.cameras[3].angle = rig.control.motion.jerk_max = odd[i];
        size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
        assert_int_equal(lumi_wire_decode_profile(data, size, &scratch, &back, NULL), LUMI_OK);
        assert_memory_equal(&back.index, &odd[i], sizeof odd[i]);
        assert_memory_equal(&back.cameras[3].angle, &odd[i], sizeof odd[i]);
        assert_memory_equal(&back.control.motion.jerk_max, &odd[i], sizeof odd[i]);
        if (!isfinite(odd[i]))
            assert_true(lumi_rig_check(&back, NULL) != LUMI_OK); /* there it is refused */
    }
}

/* The scratch message as it stands, decoded. */
static int decode(void)
{
    static lumi_wire_Profile other;
    struct lumi_error error = {0};
    pb_ostream_t stream = pb_ostream_from_buffer(data, sizeof data);
    struct lumi_rig rig;

    assert_true(pb_encode(&stream, lumi_wire_Profile_fields, &scratch));
    int code = lumi_wire_decode_profile(data, stream.bytes_written, &other, &rig, &error);
    assert_true(code == LUMI_OK || (error.code == code && error.text[0]));
    return code;
}

static void reset(void)
{
    struct lumi_rig rig;

    fill(&rig);
    assert_true(lumi_wire_encode_profile(&rig, &scratch, data, sizeof data) > 0);
}

static void what_no_profile_can_hold_is_refused(void **state)
{
    bool *const parts[] = {&scratch.has_drive,  &scratch.has_string, &scratch.has_uncertainty,
                           &scratch.has_motion, &scratch.has_video,  &scratch.has_safety};
    uint32_t *const choices[] = {&scratch.drive.gear_motor,
                                 &scratch.drive.turns,
                                 &scratch.string.run,
                                 &scratch.lenses[3].model,
                                 &scratch.lenses[2].width,
                                 &scratch.cameras[15].lens,
                                 &scratch.motion.drive,
                                 &scratch.safety.reactions[10].motor,
                                 &scratch.safety.reactions[0].triggers};
    struct lumi_rig rig;

    (void)state;
    reset();
    assert_int_equal(decode(), LUMI_OK);
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        reset();
        *parts[i] = false;
        assert_int_equal(decode(), LUMI_ERR_FORMAT);
    }
    for (size_t i = 0; i < sizeof choices / sizeof choices[0]; i++) {
        reset();
        *choices[i] = UINT32_MAX;
        assert_int_equal(decode(), LUMI_ERR_FORMAT);
    }
    reset();
    scratch.safety.reactions_count--;
    assert_int_equal(decode(), LUMI_ERR_FORMAT);
    reset();
    scratch.version++;
    assert_int_equal(decode(), LUMI_ERR_VERSION);
    scratch.version = 0;
    assert_int_equal(decode(), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_wire_decode_profile(data, 0, &scratch, &rig, NULL), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_wire_decode_profile((const uint8_t *)"rig", 3, &scratch, &rig, NULL), LUMI_ERR_FORMAT);
}

static void seventeen_cameras_and_five_lenses_are_refused(void **state)
{
    struct lumi_rig rig;

    (void)state;
    fill(&rig);
    rig.camera_count = 17;
    assert_int_equal(lumi_wire_encode_profile(&rig, &scratch, data, sizeof data), 0);
    rig.camera_count = 1;
    rig.lens_count = 5;
    assert_int_equal(lumi_wire_encode_profile(&rig, &scratch, data, sizeof data), 0);
    rig.lens_count = 1;
    size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
    for (int i = 0; i < 16; i++) { /* sixteen more, empty */
        data[size++] = 6 << 3 | 2;
        data[size++] = 0;
        assert_int_equal(lumi_wire_decode_profile(data, size, &scratch, &rig, NULL),
                         i < 15 ? LUMI_OK : LUMI_ERR_FORMAT);
    }
}

static void a_profile_that_is_cut_is_never_taken_for_whole(void **state)
{
    static uint8_t whole[LUMI_WIRE_PROFILE_MAX];
    struct lumi_rig rig;

    (void)state;
    fill(&rig);
    size_t size = lumi_wire_encode_profile(&rig, &scratch, whole, sizeof whole);
    for (size_t cut = 0; cut < size; cut++)
        assert_int_equal(lumi_wire_decode_profile(whole, cut, &scratch, &rig, NULL), LUMI_ERR_FORMAT);
    fill(&rig);
    assert_int_equal(lumi_wire_encode_profile(&rig, &scratch, whole, size - 1), 0); /* no room */
}

static void every_field_of_a_plan_comes_back(void **state)
{
    struct lumi_plan plan, back;
    lumi_wire_Plan message;
    size_t lost = 0;

    (void)state;
    memset(&plan, 1, sizeof plan);
    name(plan.name, "bracketed");
    plan.mode = LUMI_PLAN_VIDEO;
    plan.wind = LUMI_PLAN_WIND_NONE;
    plan.bracket = LUMI_PLAN_BRACKET;
    lumi_wire_from_plan(&plan, &message);
    assert_int_equal(lumi_wire_to_plan(&message, &back, NULL), LUMI_OK);
    for (size_t i = 0; i < sizeof plan; i++)
        lost += ((const uint8_t *)&plan)[i] != ((const uint8_t *)&back)[i];
    assert_int_equal(lost, PLAN_PADDING);
}

static void plans_that_the_struct_cannot_hold_are_refused(void **state)
{
    lumi_wire_Plan message = {0};
    uint32_t *const fields[] = {&message.mode, &message.wind, &message.positions, &message.first_turn, &message.turns};
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_wire_to_plan(&message, &plan, NULL), LUMI_OK); /* lumi_plan_check looks at the rest */
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        *fields[i] = 0x80000000;
        assert_int_equal(lumi_wire_to_plan(&message, &plan, NULL), LUMI_ERR_FORMAT);
        *fields[i] = 0;
    }
    message.mode = 3;
    assert_int_equal(lumi_wire_to_plan(&message, &plan, NULL), LUMI_ERR_FORMAT);
}

static void the_checksum_of_a_plan_tells_every_change(void **state)
{
    struct lumi_plan plan = {.name = "a", .positions = 72, .turns = 2, .turn_time = 30, .bracket = 1};
    uint32_t crc = lumi_wire_plan_crc(&plan);

    (void)state;
    plan.exposures[0] = 0.004;
    assert_int_not_equal(lumi_wire_plan_crc(&plan), crc);
    plan.exposures[0] = 0;
    assert_int_equal(lumi_wire_plan_crc(&plan), crc);
    plan.turn_time = nextafter(30, 31);
    assert_int_not_equal(lumi_wire_plan_crc(&plan), crc);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_field_of_the_profile_comes_back),
        cmocka_unit_test(the_rigs_there_are_come_back_and_are_sound),
        cmocka_unit_test(a_projection_is_no_lens),
        cmocka_unit_test(numbers_of_every_kind_come_back_bit_for_bit),
        cmocka_unit_test(what_no_profile_can_hold_is_refused),
        cmocka_unit_test(seventeen_cameras_and_five_lenses_are_refused),
        cmocka_unit_test(a_profile_that_is_cut_is_never_taken_for_whole),
        cmocka_unit_test(every_field_of_a_plan_comes_back),
        cmocka_unit_test(plans_that_the_struct_cannot_hold_are_refused),
        cmocka_unit_test(the_checksum_of_a_plan_tells_every_change),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
