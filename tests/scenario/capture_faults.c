/* Bad days of a capture: seeded fault scripts, and a capture that is complete and true all the same.
 * usage: capture_faults [COUNT [FIRST_SEED]]; LUMI_FAULTS_COUNT in the environment does the same for ctest */
#include "capture_operator.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int first_seed = 1, seeds = 500;
static int happened[WORLD_FAULT_KINDS];

/* A small rig and a short sweep; modes, brackets, links and formats by the seed's digits. */
static void choose(struct capture_operator *o, int seed, struct world_options *options)
{
    struct world *w = &o->w;
    struct lumi_error error = {0};

    if (lumi_rig_arc(&w->rig, 2 + seed % 3, 8, 1, 0.35, 64, 48, 1.9, 1.5, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    w->rig.microsteps = 4;
    lumi_plan_init(&w->plan, &w->rig);
    w->plan.turn_time = 8;
    w->plan.exposures[0] = 1.0 / 1000;
    if (seed % 5 < 2) {
        w->plan.mode = LUMI_PLAN_START_STOP;
        w->plan.turn_time = 16;
        w->plan.bracket = seed % 5 == 0 ? 2 : 1;
        w->plan.exposures[1] = 1.0 / 250;
        w->plan.bracket_gap = w->plan.bracket > 1 ? 0.3 : 0;
    }
    world_options_init(options);
    options->seed = (uint64_t)seed;
    options->sync_lines = seed % 3 == 0;
    options->raw = seed % 4 == 1;
    options->link = seed % 2 ? BOARD_LINK_USB : BOARD_LINK_SERIAL;
    if (options->link == BOARD_LINK_SERIAL)
        options->link_rate = 11520;
    if (seed % 7 == 0)
        options->store_memory = 24 << 10;
}

static bool one_day(int seed)
{
    static char text[8192];
    struct capture_operator *o = calloc(1, sizeof *o);
    struct capture_account account = {0};
    struct world_options options;
    struct world_script script;
    bool good;

    choose(o, seed, &options);
    o->keeps_going = true;
    world_script_random(&script, (uint64_t)seed, 6, lumi_plan_shots(&o->w.plan), o->w.rig.camera_count);
    good = world_create(&o->w, &options);
    world_set_script(&o->w, &script);
    good = good && world_daemon_start(&o->w) && capture_operator_run(o, 900);
    good = good && capture_truth_judge(&o->w, o->capture, true, &account);
    world_destroy(&o->w);
    for (int i = 0; i < WORLD_FAULT_KINDS; i++)
        happened[i] += (int)(script.happened >> i & 1);
    if (o->w.why[0]) {
        world_script_print(&script, text, sizeof text);
        print_message("seed %d (%d cameras, %s, bracket %d): %s\n%s", seed, o->w.rig.camera_count,
                      o->w.plan.mode == LUMI_PLAN_START_STOP ? "start-stop" : "continuous", o->w.plan.bracket, o->w.why,
                      text);
        good = false;
    }
    free(o);
    return good;
}

static void no_bad_day_loses_mixes_or_doubles_a_frame(void **state)
{
    int bad = 0;

    (void)state;
    for (int seed = first_seed; seed < first_seed + seeds; seed++)
        bad += !one_day(seed);
    print_message("%d fault scripts, %d bad; faults that happened:", seeds, bad);
    for (int i = 0; i < WORLD_FAULT_KINDS; i++)
        print_message(" %s %d", world_fault_names[i], happened[i]);
    print_message("\n");
    assert_int_equal(bad, 0);
}

/* Found by more of them than every run has. */
static void what_went_wrong_once_does_not_again(void **state)
{
    static const int regressions[] = {
        2835, /* a camera that went and came while the daemon hung */
    };

    (void)state;
    for (size_t i = 0; i < sizeof regressions / sizeof regressions[0]; i++)
        assert_true(one_day(regressions[i]));
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_bad_day_loses_mixes_or_doubles_a_frame),
        cmocka_unit_test(what_went_wrong_once_does_not_again),
    };
    const char *count = getenv("LUMI_FAULTS_COUNT");

    if (argc > 1 || count)
        seeds = atoi(argc > 1 ? argv[1] : count);
    if (argc > 2)
        first_seed = atoi(argv[2]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
