/* Captures on good days, and on days with one thing wrong that must be found and called by its name. */
#include "capture_operator.h"

#include "proto/base/memory.h"

#include <glib.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

struct day {
    struct capture_operator o;
    struct world_options options;
    struct world_script script;
    struct capture_account account;
    struct lumi_capture_incident *incidents;
    int incident_count;
};

static struct day *day_create(int cameras, int positions)
{
    struct day *d = calloc(1, sizeof *d);
    struct lumi_error error = {0};

    if (lumi_rig_arc(&d->o.w.rig, cameras, positions, 1, 0.35, 64, 48, 1.9, 1.5, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    d->o.w.rig.microsteps = 4;
    lumi_plan_init(&d->o.w.plan, &d->o.w.rig);
    d->o.w.plan.turn_time = positions;
    d->o.w.plan.exposures[0] = 1.0 / 1000;
    world_options_init(&d->options);
    d->o.keeps_going = true;
    return d;
}

static void read_incidents(struct day *d)
{
    struct lumi_capture *capture;
    struct lumi_error error = {0};

    if (lumi_capture_open(d->o.capture, LUMI_CAPTURE_READ, &capture, &error) != LUMI_OK ||
        lumi_capture_incidents(capture, &d->incidents, &d->incident_count, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    lumi_capture_close(capture);
}

/* Runs it to a capture that is complete and true. */
static void day_run(struct day *d, const char *what)
{
    struct world *w = &d->o.w;
    struct lumi_error error = {0};
    clock_t began = clock();

    if (lumi_plan_check(&w->plan, &w->rig, &error) != LUMI_OK)
        fail_msg("%s: %s", what, error.text);
    bool good = world_create(w, &d->options);
    world_set_script(w, &d->script);
    good = good && world_daemon_start(w) && capture_operator_run(&d->o, 4000);
    good = good && capture_truth_judge(w, d->o.capture, true, &d->account);
    if (!good)
        fail_msg("%s: %s", what, w->why);
    read_incidents(d);
    print_message("%s: %d rows, %d stored, %d retaken; %d incidents; %d frames, %zu bytes in memory at most; %.1f s in "
                  "%.2f s of CPU\n",
                  what, d->account.rows, d->account.stored, d->account.retaken, d->incident_count, w->frames_out_most,
                  w->bytes_out_most, world_seconds(w), (double)(clock() - began) / CLOCKS_PER_SEC);
}

static void day_destroy(struct day *d)
{
    world_destroy(&d->o.w);
    if (d->o.w.why[0])
        fail_msg("%s", d->o.w.why);
    lumi_free(d->incidents);
    free(d);
}

/* Nothing went wrong, and nothing was done twice. */
static void assert_clean(const struct day *d)
{
    const struct world *w = &d->o.w;
    int frames = lumi_plan_frames(&w->plan, &w->rig);

    assert_int_equal(d->o.starts, 1);
    assert_int_equal(d->o.retakes, 0);
    assert_int_equal(d->o.resumes, 0);
    assert_int_equal(d->account.rows, frames);
    assert_int_equal(d->account.accepted, frames);
    for (int i = 0; i < d->incident_count; i++)
        print_message("unexpected: %s: %s\n", d->incidents[i].kind, d->incidents[i].text);
    assert_int_equal(d->incident_count, 0);
    assert_int_equal(w->shots_told, lumi_plan_shots(&w->plan));
    assert_int_equal(w->sealed_count, 1);
    assert_true(w->status->complete);
    assert_int_equal(w->status->accepted, frames);
    assert_true(w->frames_out_most <= w->rig.camera_count * 8);
}

static void a_continuous_sweep_is_stored_whole(void **state)
{
    struct day *d = day_create(6, 24);

    (void)state;
    d->options.sync_lines = true;
    day_run(d, "continuous");
    assert_clean(d);
    day_destroy(d);
}

static void raw_frames_become_files_that_hold_them(void **state)
{
    struct day *d = day_create(3, 12);

    (void)state;
    d->options.raw = true;
    day_run(d, "raw");
    assert_clean(d);
    day_destroy(d);
}

static void a_start_stop_sweep_is_stored_whole(void **state)
{
    struct day *d = day_create(4, 12);

    (void)state;
    d->o.w.plan.mode = LUMI_PLAN_START_STOP;
    d->o.w.plan.turn_time = 24;
    day_run(d, "start-stop");
    assert_clean(d);
    day_destroy(d);
}

static void a_bracket_has_the_exposures_of_the_plan(void **state)
{
    struct day *d = day_create(3, 8);

    (void)state;
    d->o.w.plan.mode = LUMI_PLAN_START_STOP;
    d->o.w.plan.turn_time = 40;
    d->o.w.plan.bracket = 3;
    d->o.w.plan.exposures[1] = 1.0 / 250;
    d->o.w.plan.exposures[2] = 1.0 / 60;
    d->o.w.plan.bracket_gap = 0.4;
    day_run(d, "bracket");
    assert_clean(d);
    day_destroy(d);
}

static void a_rig_on_its_string_goes_round_twice(void **state)
{
    struct day *d = day_create(3, 12);
    struct lumi_error error = {0};

    (void)state;
    if (lumi_rig_arc(&d->o.w.rig, 3, 12, 2, 0.35, 64, 48, 1.9, 1.5, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    d->o.w.rig.microsteps = 4;
    lumi_plan_init(&d->o.w.plan, &d->o.w.rig);
    d->o.w.plan.turn_time = 12;
    d->o.w.plan.exposures[0] = 1.0 / 1000;
    day_run(d, "string");
    assert_clean(d);
    day_destroy(d);
}

/* ---- one thing wrong ---- */

static const struct {
    enum world_fault_kind fault;
    const char *word; /* in the kind or the text of an incident */
    int retaken;      /* frames at least */
    double value;
} faults[] = {
    {WORLD_FAULT_DROP, "drop", 1, 0},
    {WORLD_FAULT_VANISH, "drop", 1, 0},
    {WORLD_FAULT_LATE, "late", 0, 1.5},
    {WORLD_FAULT_DOUBLE, "doubl", 0, 0},
    {WORLD_FAULT_SWAP, "order", 0, 0},
    {WORLD_FAULT_DAMAGE, "damaged", 1, 0},
    {WORLD_FAULT_BLUR, "", 1, 0},
    {WORLD_FAULT_EXPOSURE, "exposure", 1, 0},
    {WORLD_FAULT_SPURIOUS, "surplus", 0, 0},
    {WORLD_FAULT_UNPLUG_CAMERA, "camera", 1, 0},
    {WORLD_FAULT_SYNC_MISSING, "", 0, 0},
};

static bool named(const struct day *d, const char *word)
{
    for (int i = 0; i < d->incident_count; i++)
        if (strstr(d->incidents[i].kind, word) || strstr(d->incidents[i].text, word))
            return true;
    return false;
}

static void what_is_wrong_with_a_frame_is_found_and_named(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        struct day *d = day_create(3, 10);
        const char *name = world_fault_names[faults[i].fault];
        d->options.sync_lines = true;
        d->script.count = 1;
        d->script.faults[0] = (struct world_fault){
            .kind = faults[i].fault, .shot = 4, .at = 0.5, .camera = 1, .count = 1, .value = faults[i].value};
        d->script.faults[0].duration = 2.5;
        day_run(d, name);
        if (d->account.retaken < faults[i].retaken || (!faults[i].retaken && d->account.retaken))
            fail_msg("%s: %d frames were retaken", name, d->account.retaken);
        for (int k = 0; k < d->incident_count && d->o.w.trace; k++)
            print_message("  %s: %s\n", d->incidents[k].kind, d->incidents[k].text);
        if (faults[i].word[0] && !named(d, faults[i].word))
            fail_msg("%s: no incident names it", name);
        day_destroy(d);
    }
}

/* The first frames come late and the next triggers are not seen: without what the test shots have said of the camera's
 * clock they would fit the shots behind their own. */
static void the_test_shots_tell_of_which_shots_the_first_frames_are(void **state)
{
    struct day *d = day_create(2, 8);

    (void)state;
    d->script.count = 2;
    d->script.faults[0] = (struct world_fault){
        .kind = WORLD_FAULT_LATE, .shot = -1, .at = 6, .camera = 1, .count = 2, .value = 1.85, .duration = 9};
    d->script.faults[1] =
        (struct world_fault){.kind = WORLD_FAULT_VANISH, .shot = 1, .at = 0.04, .camera = 1, .count = 2, .duration = 5};
    day_run(d, "the first frames late");
    assert_int_equal(d->account.retaken, 2);
    assert_true(named(d, "late"));
    day_destroy(d);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_continuous_sweep_is_stored_whole),
        cmocka_unit_test(raw_frames_become_files_that_hold_them),
        cmocka_unit_test(a_start_stop_sweep_is_stored_whole),
        cmocka_unit_test(a_bracket_has_the_exposures_of_the_plan),
        cmocka_unit_test(a_rig_on_its_string_goes_round_twice),
        cmocka_unit_test(what_is_wrong_with_a_frame_is_found_and_named),
        cmocka_unit_test(the_test_shots_tell_of_which_shots_the_first_frames_are),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
