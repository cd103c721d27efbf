/* The engine's process is killed, as by kill -9, at moments of every kind: while frames are planned, triggered,
 * exposed, received, being written, judged, taken again. The rig and the cameras live on; another process finds the
 * capture and completes it. usage: capture_kill PROGRAM [KILLS [FIRST_SEED]] */
#include "capture_operator.h"
#include "remote_engine.h"

#include "sim/random.h"

#include <glib.h>
#include <setjmp.h>
#include <sqlite3.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static int kills = 108, first_seed = 1;
#define KILLS_A_SWEEP 9

enum inside { PLANNED = 0, TRIGGERED, EXPOSED, IN_MEMORY, COMMITTING, RECEIVED, ACCEPTED, REJECTED, RETAKE, INSIDES };
static const char *const inside_names[INSIDES] = {"planned", "triggered", "exposed",  "received in memory", "storing",
                                                  "stored",  "accepted",  "rejected", "a retake under way"};
static int inside[INSIDES], done;

static const struct {
    enum remote_op op;
    int most; /* calls until then */
    bool busy, round;
} moments[] = {
    {REMOTE_RIG_NOTICE, 12, false, false},
    {REMOTE_SYNC_EDGE, 16, false, false},
    {REMOTE_CAMERA_NOTICE, 60, false, false},
    {0, 12, true, false},
    {REMOTE_RUN, 6, true, false},
    {REMOTE_JUDGED, 16, false, false},
    {0, 120, false, true},
    {0, 400, false, false},
    {REMOTE_RIG_REPLY, 6, false, false},
};
#define MOMENTS (int)(sizeof moments / sizeof moments[0])

static void aim(struct world *w, int number)
{
    int m = number % MOMENTS;

    remote_kill = (struct remote_kill){.op = moments[m].op, .busy = moments[m].busy, .round = moments[m].round};
    remote_kill.count = 1 + (int)(world_random(w) * moments[m].most);
    remote_kill.delay_us = world_random(w) < 0.3 ? -1 : (int)(world_random(w) * world_random(w) * 1500);
}

static int count(sqlite3 *db, const char *what)
{
    g_autofree char *sql = g_strdup_printf("SELECT count(*) FROM frames WHERE %s", what);
    sqlite3_stmt *q = NULL;
    int n = 0;

    if (sqlite3_prepare_v2(db, sql, -1, &q, NULL) == SQLITE_OK && sqlite3_step(q) == SQLITE_ROW)
        n = sqlite3_column_int(q, 0);
    sqlite3_finalize(q);
    return n;
}

/* In which states frames were when it died. The database is read in a copy: looking would mend it. */
static void look(struct world *w, int starts)
{
    g_autofree char *path = g_strdup_printf("%s/sweep-%d", w->folder, starts);
    g_autofree char *data = g_strdup_printf("%s/data", path), *copy = g_strdup_printf("%s.look", w->folder);
    g_autofree char *file = g_strdup_printf("%s/capture.db", copy);
    sqlite3 *db = NULL;
    int delivered = 0;

    for (int i = 0; i < w->exposure_count; i++)
        delivered += w->exposures[i].delivered && w->exposures[i].shot >= 0;
    if (world_copy_folder(data, copy) && sqlite3_open(file, &db) == SQLITE_OK) {
        inside[PLANNED] += count(db, "state = 'planned'") > 0;
        inside[TRIGGERED] += count(db, "state = 'triggered'") > 0;
        inside[EXPOSED] += count(db, "state = 'triggered' AND exposed_time_us IS NOT NULL") > 0;
        inside[RECEIVED] += count(db, "state = 'received'") > 0;
        inside[ACCEPTED] += count(db, "state = 'accepted'") > 0;
        inside[REJECTED] += count(db, "state = 'rejected'") > 0;
        inside[RETAKE] += count(db, "retake_of IS NOT NULL AND state IN ('planned', 'triggered')") > 0;
        inside[IN_MEMORY] += count(db, "file IS NOT NULL") < delivered - 2;
        inside[COMMITTING] += remote_kill.jobs > 0;
    }
    sqlite3_close(db);
    world_remove_folder(copy);
}

static void choose(struct world *w, int seed, struct world_options *options, const char *folder)
{
    struct lumi_error error = {0};

    if (lumi_rig_arc(&w->rig, 3, 10, 1, 0.35, 64, 48, 1.9, 1.5, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    w->rig.microsteps = 4;
    lumi_plan_init(&w->plan, &w->rig);
    w->plan.turn_time = 10;
    w->plan.exposures[0] = 1.0 / 1000;
    if (seed % 3 == 2) {
        w->plan.mode = LUMI_PLAN_START_STOP;
        w->plan.turn_time = 20;
    }
    world_options_init(options);
    options->seed = (uint64_t)seed;
    options->sync_lines = true;
    options->blurred = 0.15;
    options->raw = seed % 2 == 1;
    options->dead = remote_engine_dead;
    options->folder = folder;
}

/* One sweep, killed again and again. */
static bool one_sweep(int seed, const char *folder)
{
    struct capture_operator *o = calloc(1, sizeof *o);
    struct capture_account account = {0};
    struct world_options options;
    int here = 0;

    choose(&o->w, seed, &options, folder);
    o->keeps_going = true;
    bool good = world_create(&o->w, &options) && world_daemon_start(&o->w);
    aim(&o->w, seed + done);
    double until = world_seconds(&o->w) + 3000;
    while (good && !o->complete && world_seconds(&o->w) < until) {
        uint64_t before = o->w.generation;
        capture_operator_act(o);
        good = !o->w.why[0];
        if (remote_kill.crashed)
            good = world_wrong(&o->w, "the engine's process ended by itself");
        if (before == o->w.generation)
            continue;
        look(&o->w, o->starts);
        done++;
        if (++here < KILLS_A_SWEEP)
            aim(&o->w, seed + done);
        else
            remote_kill.count = 0;
    }
    remote_kill.count = 0;
    if (good && !o->complete)
        good = world_wrong(&o->w, "not complete: %s, %s", o->w.status->text, o->last);
    good = good && capture_truth_judge(&o->w, o->capture, true, &account);
    world_destroy(&o->w);
    if (o->w.why[0])
        print_message("seed %d: after %d kills: %s\n", seed, here, o->w.why);
    good = good && !o->w.why[0];
    free(o);
    return good;
}

static void whatever_state_a_frame_is_in_a_killed_engine_is_recovered(void **state)
{
    g_autofree char *folder = g_dir_make_tmp("lumi-kill-XXXXXX", NULL);
    int bad = 0, sweeps = 0;

    (void)state;
    while (done < kills && bad < 5) {
        g_autofree char *inner = g_strdup_printf("%s/%d", folder, sweeps);
        g_mkdir_with_parents(inner, 0755);
        bad += !one_sweep(first_seed + sweeps++, inner);
        if (!bad)
            world_remove_folder(inner);
    }
    print_message("killed %d times in %d sweeps; with frames inside:", done, sweeps);
    for (int i = 0; i < INSIDES; i++)
        print_message(" %s %d", inside_names[i], inside[i]);
    print_message("\n");
    if (!bad)
        world_remove_folder(folder);
    assert_int_equal(bad, 0);
    for (int i = 0; i < INSIDES; i++)
        assert_true(inside[i] >= 2);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(whatever_state_a_frame_is_in_a_killed_engine_is_recovered),
    };

    if (argc < 2)
        return 2;
    remote_engine_program = argv[1];
    if (argc > 2)
        kills = atoi(argv[2]);
    if (argc > 3)
        first_seed = atoi(argv[3]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
