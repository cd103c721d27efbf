/* A capture's calibration as a whole, on a run that was made up: bad input is found, named and left out. */
#include "pipeline/calibrate/align.h"
#include "pipeline/calibrate/calibration.h"
#include "shaken_rig.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)
#define CAMERAS 6
#define POSITIONS 18

struct world {
    struct shaken shaken;
    struct lumi_run run;
    struct lumi_rig rig;
    struct lumi_evidence evidence;
    struct lumi_tracks tracks;
    GArray *motions;
};

static void make_sources(struct world *w)
{
    const struct shaken *s = &w->shaken;

    w->run = (struct lumi_run){.capture = (char *)"made up", .rig = &w->rig, .count = s->bundle.camera_count};
    w->run.sources = g_new0(struct lumi_source, (gsize)w->run.count);
    for (int i = 0; i < w->run.count; i++) {
        struct lumi_source *source = &w->run.sources[i];
        const struct lumi_mechanism_frame *f = &s->mechanism.frames[i];
        g_snprintf(source->name, sizeof source->name, "f%03d", i);
        g_strlcpy(source->camera_name, w->rig.cameras[f->camera].name, sizeof source->camera_name);
        source->camera = source->lens_slot = f->camera;
        source->position = f->shot;
        source->turn_angle = f->turn_angle;
        source->drop = f->drop;
        source->lens = s->bundle.lenses[0].lens;
        source->pose = source->prior = s->bundle.cameras[i].prior;
    }
}

/* What neighbours say of one another, were they matched without a prior: the truth. */
static void make_motions(struct world *w)
{
    w->motions = g_array_new(FALSE, TRUE, sizeof(struct lumi_motion));
    for (int i = 0; i < w->run.count; i++)
        for (int k = i + 1; k < w->run.count; k++) {
            const struct lumi_pose *a = &w->shaken.truth[i], *b = &w->shaken.truth[k];
            struct lumi_motion m = {.a = i, .b = k, .free_count = 60};
            if (lumi_dot(lumi_axis(a, 2), lumi_axis(b, 2)) < cos(32 * DEGREE))
                continue;
            lumi_rotation_between(a->r, b->r, m.rotation);
            m.direction = lumi_normalize(lumi_rotate_back(a->r, lumi_sub(b->t, a->t)));
            g_array_append_val(w->motions, m);
        }
    w->evidence.motions = (struct lumi_motion *)(void *)w->motions->data;
    w->evidence.motion_count = (int)w->motions->len;
}

static void make_world(struct world *w, double noise)
{
    const struct shaken_settings settings = {1, 0.002, 0.2 * DEGREE, noise, 0.03, 2500, 80};
    struct shaken *s = &w->shaken;

    *w = (struct world){0};
    assert_int_equal(lumi_rig_arc(&w->rig, CAMERAS, POSITIONS, 1, 0.7, 640, 512, 110 * DEGREE, 88 * DEGREE, NULL),
                     LUMI_OK);
    shaken_init(s, &w->rig, &settings);
    make_sources(w);
    w->tracks.track_count = s->bundle.point_count;
    w->tracks.observation_count = s->bundle.observation_count;
    w->tracks.tracks = g_new0(struct lumi_track, (gsize)s->bundle.point_count);
    w->tracks.observations = g_new0(struct lumi_observation, (gsize)s->bundle.observation_count);
    w->evidence.frames = g_new0(struct lumi_frame_evidence, (gsize)w->run.count);
    for (int i = 0; i < w->tracks.track_count; i++)
        w->tracks.tracks[i] = (struct lumi_track){s->bundle.first[i], s->bundle.first[i + 1] - s->bundle.first[i]};
    for (int i = 0; i < w->tracks.observation_count; i++) {
        const struct lumi_bundle_observation *o = &s->bundle.observations[i];
        w->tracks.observations[i] = (struct lumi_observation){o->camera, 0, (float)o->x, (float)o->y, (float)o->sigma};
        w->evidence.frames[o->camera].matches++;
        w->evidence.frames[o->camera].foreign++;
    }
    for (int i = 0; i < w->run.count; i++) {
        w->evidence.frames[i].features = 500;
        w->evidence.frames[i].mean = 0.4;
        w->evidence.frames[i].sharpness = 0.6 + 0.001 * (i % 7);
        w->evidence.frames[i].partners = 6;
    }
    make_motions(w);
}

static void finish_world(struct world *w)
{
    g_free(w->run.sources);
    g_free(w->tracks.tracks);
    g_free(w->tracks.observations);
    g_free(w->evidence.frames);
    g_array_free(w->motions, TRUE);
    shaken_finish(&w->shaken);
}

static void calibrate(const struct world *w, struct lumi_calibration *c)
{
    struct lumi_error error = {0};

    if (lumi_calibrate(&w->run, &w->evidence, &w->tracks, c, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static bool finds(const struct lumi_calibration *c, const char *what, const char *text)
{
    for (guint i = 0; i < c->findings->len; i++) {
        const struct lumi_finding *f = &g_array_index(c->findings, struct lumi_finding, i);
        if (!strcmp(f->what, what) && strstr(f->text, text))
            return true;
    }
    return false;
}

/* All that are used are where they truly are. */
static void poses_are_right(const struct world *w, const struct lumi_calibration *c)
{
    int count = 0;
    g_autofree struct lumi_pose *from = g_new(struct lumi_pose, (gsize)w->run.count);
    g_autofree struct lumi_pose *to = g_new(struct lumi_pose, (gsize)w->run.count);
    struct lumi_similarity similarity;
    struct lumi_pose_distance d;

    for (int i = 0; i < w->run.count; i++)
        if (c->frames[i].used) {
            from[count] = c->poses[i];
            to[count++] = w->shaken.truth[i];
        }
    assert_int_equal(lumi_align(count, from, to, &similarity, NULL), LUMI_OK);
    assert_int_equal(lumi_pose_compare(count, from, to, &similarity, &d, NULL), LUMI_OK);
    assert_true(d.median_m < 0.001 && d.worst_m < 0.005);
}

static void a_black_picture_and_an_unfocused_camera_are_named_and_left_out(void **state)
{
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    w.evidence.frames[9].mean = 0.004;
    w.evidence.frames[9].features = 0;
    for (int i = 0; i < w.run.count; i++)
        if (w.run.sources[i].camera == 2)
            w.evidence.frames[i].sharpness = 0.2;
    calibrate(&w, &c);
    g_autofree char *blurred = g_strdup_printf("camera %s", w.rig.cameras[2].name);
    assert_true(finds(&c, "frame f009", "black"));
    assert_true(finds(&c, blurred, "unfocused"));
    for (int i = 0; i < w.run.count; i++)
        assert_int_equal(c.frames[i].used, i != 9 && w.run.sources[i].camera != 2);
    assert_true(strstr(c.frames[9].why, "black") != NULL);
    poses_are_right(&w, &c);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

/* Frames of these two cameras carry each other's name and prior. */
static void exchange(struct world *w, int first, int second)
{
    for (int i = 0; i < w->run.count; i++) {
        struct lumi_source *source = &w->run.sources[i];
        int camera = source->camera == first ? second : source->camera == second ? first : -1;
        if (camera < 0)
            continue;
        g_strlcpy(source->camera_name, w->rig.cameras[camera].name, sizeof source->camera_name);
        source->camera = source->lens_slot = camera;
        lumi_rig_camera_pose_at(&w->rig, camera, source->turn_angle, source->drop, &source->prior);
    }
}

/* The free matches of a pair lie outside where the priors have them. */
static void contradict(struct world *w)
{
    for (int i = 0; i < w->evidence.motion_count; i++) {
        struct lumi_motion *m = &w->evidence.motions[i];
        double between[9];
        lumi_rotation_between(w->run.sources[m->a].prior.r, w->run.sources[m->b].prior.r, between);
        if (lumi_rotation_angle(between, m->rotation) > 4 * DEGREE)
            m->free_outside = m->free_count * 9 / 10;
    }
}

static void two_cameras_in_each_others_place_are_named_and_the_rest_is_calibrated(void **state)
{
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    exchange(&w, 1, 4);
    contradict(&w);
    calibrate(&w, &c);
    g_autofree char *first = g_strdup_printf("camera %s", w.rig.cameras[1].name);
    assert_true(finds(&c, first, w.rig.cameras[4].name));
    assert_true(finds(&c, first, "in each other's place"));
    g_autofree char *advice = g_strdup_printf("--exchange %s:%s", w.rig.cameras[1].name, w.rig.cameras[4].name);
    assert_true(finds(&c, first, advice));
    for (int i = 0; i < w.run.count; i++)
        assert_int_equal(c.frames[i].used, w.run.sources[i].camera != 1 && w.run.sources[i].camera != 4);
    poses_are_right(&w, &c);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void a_rig_that_turned_the_other_way_is_said_to_have(void **state)
{
    struct lumi_error error = {0};
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    w.rig.direction = -w.rig.direction;
    for (int i = 0; i < w.run.count; i++) {
        struct lumi_source *source = &w.run.sources[i];
        source->turn_angle = 2 * w.rig.index - source->turn_angle;
        lumi_rig_camera_pose_at(&w.rig, source->camera, source->turn_angle, source->drop, &source->prior);
    }
    contradict(&w);
    assert_int_equal(lumi_calibrate(&w.run, &w.evidence, &w.tracks, &c, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "turned the other way"));
    g_autofree char *advice = g_strdup_printf("direction = %d", -w.rig.direction);
    assert_non_null(strstr(error.text, advice));
    assert_non_null(strstr(error.text, "--backwards"));
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void a_missing_row_and_a_camera_without_neighbours_are_named(void **state)
{
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    for (int i = 0; i < w.tracks.observation_count; i++) {
        /* What camera 5 sees, nobody else does. */
        struct lumi_observation *o = &w.tracks.observations[i];
        if (w.run.sources[o->image].camera == 5) {
            o->x = fmodf(o->x * 17.0f, 640);
            o->y = fmodf(o->y * 23.0f, 512);
        }
    }
    for (int i = 0; i < w.run.count; i++)
        if (w.run.sources[i].camera == 5)
            w.evidence.frames[i].matches = w.evidence.frames[i].foreign = 3;
    for (int i = 0; i < w.evidence.motion_count; i++)
        if (w.run.sources[w.evidence.motions[i].a].camera == 5 || w.run.sources[w.evidence.motions[i].b].camera == 5)
            w.evidence.motions[i].free_count = 0;
    /* Another camera's name is nowhere: its row is missing. */
    for (int i = 0; i < w.run.count; i++)
        if (w.run.sources[i].camera == 0)
            g_strlcpy(w.run.sources[i].camera_name, "spare", sizeof w.run.sources[i].camera_name);
    calibrate(&w, &c);
    g_autofree char *alone = g_strdup_printf("camera %s", w.rig.cameras[5].name);
    g_autofree char *missing = g_strdup_printf("camera %s", w.rig.cameras[0].name);
    assert_true(finds(&c, alone, "shares nothing with the other cameras"));
    assert_false(finds(&c, alone, "is not where the rig profile has it"));
    assert_true(finds(&c, missing, "missing row"));
    for (int i = 0; i < w.run.count; i++)
        assert_int_equal(c.frames[i].used, w.run.sources[i].camera != 5);
    poses_are_right(&w, &c);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void pictures_that_never_came_and_short_brackets_are_named(void **state)
{
    struct lumi_source_part parts[2] = {{.exposure_offset = -2}, {.exposure_offset = 0}};
    struct lumi_missing missing[2] = {{.why = "the video lacks it", .camera = 3, .position = 7},
                                      {.camera = 3, .position = 9}};
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    for (int k = 0; k < 2; k++)
        g_strlcpy(missing[k].camera_name, w.rig.cameras[3].name, sizeof missing[k].camera_name);
    w.run.missing = missing;
    w.run.missing_count = 2;
    for (int i = 0; i < w.run.count; i++) {
        w.run.sources[i].parts = parts;
        w.run.sources[i].part_count = i % 5 == 4 ? 1 : 2;
    }
    calibrate(&w, &c);
    g_autofree char *camera = g_strdup_printf("camera %s", w.rig.cameras[3].name);
    assert_true(finds(&c, camera, "lacks 2 of 20 pictures in turn 0 (positions 7, 9): the video lacks it"));
    assert_true(finds(&c, "brackets", "21 of 108 pictures lack a shot (f004 that of +0 stops)"));
    assert_int_equal(c.used, w.run.count);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void a_lens_that_does_not_fit_is_found_from_the_capture_and_said_to_be(void **state)
{
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    for (int i = 0; i < w.run.count; i++) {
        w.run.sources[i].lens.fx *= 1.03;
        w.run.sources[i].lens.fy *= 1.03;
        w.run.sources[i].lens_slot = 0;
    }
    calibrate(&w, &c);
    assert_int_equal(c.lens_count, 1);
    assert_true(c.lenses[0].self_calibrated);
    double true_focal = w.shaken.bundle.lenses[0].lens.fx;
    assert_true(fabs(c.lenses[0].after.fx / true_focal - 1) < 0.003);
    g_autofree char *what = g_strdup_printf("lens of camera %s", w.rig.cameras[0].name);
    assert_true(finds(&c, what, "found from this capture"));
    poses_are_right(&w, &c);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void the_same_input_gives_the_same_bytes(void **state)
{
    struct lumi_calibration first, second;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    calibrate(&w, &first);
    calibrate(&w, &second);
    assert_memory_equal(first.poses, second.poses, sizeof(struct lumi_pose) * (size_t)w.run.count);
    lumi_calibration_finish(&first);
    lumi_calibration_finish(&second);
    finish_world(&w);
}

static void the_report_says_how_good_it_is_and_what_to_look_at(void **state)
{
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    w.evidence.frames[9].mean = w.evidence.frames[9].features = 0;
    calibrate(&w, &c);
    g_autofree char *text = lumi_calibration_text(&w.run, &c), *json = lumi_calibration_json(&w.run, &c);
    assert_true(g_str_has_prefix(text, "calibrated 107 of 108 pictures: "));
    assert_non_null(strstr(text, "frame f009 is black"));
    assert_non_null(strstr(text, "Mechanism, against its profile"));
    assert_non_null(strstr(json, "\"used\" : 107"));
    assert_true(c.rms > 0.3 && c.rms < 0.6);
    assert_true(c.lenses[0].covered > 0.5);
    lumi_calibration_finish(&c);
    finish_world(&w);
}

static void nothing_in_common_at_all_is_an_error_that_says_what_to_do(void **state)
{
    struct lumi_error error = {0};
    struct lumi_calibration c;
    struct world w;

    (void)state;
    make_world(&w, 0.3);
    w.tracks.track_count = w.tracks.observation_count = 0;
    for (int i = 0; i < w.run.count; i++)
        w.evidence.frames[i].matches = 0;
    assert_int_equal(lumi_calibrate(&w.run, &w.evidence, &w.tracks, &c, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "--calibrate no"));
    g_autofree char *refusal = lumi_calibration_refusal(&c, error.text);
    assert_non_null(strstr(refusal, error.text));
    lumi_calibration_finish(&c);
    finish_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_black_picture_and_an_unfocused_camera_are_named_and_left_out),
        cmocka_unit_test(two_cameras_in_each_others_place_are_named_and_the_rest_is_calibrated),
        cmocka_unit_test(a_rig_that_turned_the_other_way_is_said_to_have),
        cmocka_unit_test(a_missing_row_and_a_camera_without_neighbours_are_named),
        cmocka_unit_test(pictures_that_never_came_and_short_brackets_are_named),
        cmocka_unit_test(a_lens_that_does_not_fit_is_found_from_the_capture_and_said_to_be),
        cmocka_unit_test(the_same_input_gives_the_same_bytes),
        cmocka_unit_test(the_report_says_how_good_it_is_and_what_to_look_at),
        cmocka_unit_test(nothing_in_common_at_all_is_an_error_that_says_what_to_do),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
