/* Ten thousand shots at full speed: memory stays flat, no descriptor is left open.
 * usage: capture_soak [SHOTS] */
#include "capture_operator.h"

#include <glib.h>
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#define SHOTS_A_SWEEP 1000
#define KEPT_MOST (64 << 10) /* bytes more after the last sweep than after the second */

static int shots = 10000;

static int descriptors(void)
{
    g_autoptr(GDir) dir = g_dir_open("/proc/self/fd", 0, NULL);
    int count = 0;

    while (dir && g_dir_read_name(dir))
        count++;
    return count;
}

/* What malloc has given out and not got back, in bytes, without what the world itself remembers of every exposure and
 * trigger. */
static long used(const struct world *w)
{
    struct mallinfo2 info = mallinfo2();

    return (long)(info.uordblks + info.hblkhd) - (long)world_records_bytes(w);
}

static double resident_mb(void)
{
    long pages = 0;
    FILE *f = fopen("/proc/self/statm", "r");

    if (!f || fscanf(f, "%*d %ld", &pages) != 1)
        pages = 0;
    if (f)
        fclose(f);
    return (double)pages * (double)sysconf(_SC_PAGESIZE) / 1e6;
}

static void prepare(struct capture_operator *o, struct world_options *options)
{
    struct lumi_error error = {0};

    if (lumi_rig_arc(&o->w.rig, 2, SHOTS_A_SWEEP, 1, 0.35, 64, 48, 1.9, 1.5, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    lumi_plan_init(&o->w.plan, &o->w.rig);
    o->w.plan.turn_time = SHOTS_A_SWEEP * 0.45;
    o->w.plan.exposures[0] = 1.0 / 1000;
    if (lumi_plan_check(&o->w.plan, &o->w.rig, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    world_options_init(options);
    options->sync_lines = true;
}

static void ten_thousand_shots_leave_memory_and_descriptors_as_they_were(void **state)
{
    struct capture_operator *o = calloc(1, sizeof *o);
    struct capture_account account;
    struct world_options options;
    long held = 0, held_then = 0;
    int open_then = 0, taken = 0;
    clock_t began = clock();

    (void)state;
    prepare(o, &options);
    assert_true(world_create(&o->w, &options) && world_daemon_start(&o->w));
    for (int sweep = 0; taken < shots; sweep++) {
        o->complete = false;
        capture_operator_begin(o);
        if (!capture_operator_run(o, 4000) || !capture_truth_judge(&o->w, o->capture, true, &account))
            fail_msg("%s", o->w.why);
        assert_int_equal(account.retaken, 0);
        taken += lumi_plan_shots(&o->w.plan);
        world_remove_folder(o->capture);
        malloc_trim(0);
        held = used(&o->w);
        if (sweep < 2) { /* what is made once is there */
            held_then = held;
            open_then = descriptors();
        }
        print_message("%d shots: %.1f MB resident, %.3f MB of it kept by malloc for engine and store, %d descriptors, "
                      "%d frames at most in memory\n",
                      taken, resident_mb(), (double)held * 1e-6, descriptors(), o->w.frames_out_most);
    }
    print_message("%d shots in %.1f s of CPU\n", taken, (double)(clock() - began) / CLOCKS_PER_SEC);
    assert_int_equal(descriptors(), open_then);
    assert_true(held - held_then < KEPT_MOST);
    world_destroy(&o->w);
    assert_string_equal(o->w.why, "");
    free(o);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ten_thousand_shots_leave_memory_and_descriptors_as_they_were),
    };

    if (argc > 1)
        shots = atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
