/* Bad days: random fault scripts on small rigs, and an operator who finishes the sweep all the same.
 * usage: rig_faults [COUNT [FIRST_SEED]]; LUMI_FAULTS_COUNT in the environment does the same for ctest */
#include "rig_operator.h"

static int first_seed = 1, seeds = 1000;

/* A small rig of one of the paper's kinds, and a sweep on it; brackets, modes and brakes by the seed's digits. */
static void choose(struct rig_operator *o, int seed)
{
    struct rig_fixture *f = &o->f;
    bool brake = seed % 4 < 2;

    switch (seed % 3) {
    case 0:
        OK(lumi_rig_arc(&f->rig, 4, 12, 1, 0.35, 1280, 1024, 110 * DEGREE, 88 * DEGREE, error));
        break;
    case 1:
        OK(lumi_rig_arc(&f->rig, 3, 12, 2, 0.35, 1280, 1024, 110 * DEGREE, 88 * DEGREE, error));
        break;
    default:
        OK(lumi_rig_bar(&f->rig, 12, 2, 0.4, 0.03, 1280, 1024, 120 * DEGREE, 96 * DEGREE, error));
    }
    if (!f->rig.string.held)
        f->rig.control.safety.brake_fitted = brake;
    if (seed % 10)
        f->rig.microsteps = 4; /* a day in a quarter of the steps */
    if (seed % 7 == 0)
        for (int r = LUMI_RIG_FAULT_ESTOP + 1; r < LUMI_RIG_FAULTS; r++)
            f->rig.control.safety.reactions[r].triggers = LUMI_RIG_TRIGGERS_FINISH;
    if (seed % 9 == 4 && (f->rig.string.held || brake))
        for (int r = 0; r < LUMI_RIG_FAULTS; r++)
            f->rig.control.safety.reactions[r].motor = LUMI_RIG_MOTOR_OFF,
            f->rig.control.safety.reactions[r].brake = true;
    lumi_plan_init(&f->plan, &f->rig);
    f->plan.turn_time = 10;
    f->plan.exposures[0] = 1.0 / 1000;
    if (seed % 5 < 2) {
        f->plan.mode = LUMI_PLAN_START_STOP;
        f->plan.turn_time = 21;
        f->plan.bracket = 1 + seed % 2;
        f->plan.exposures[1] = 1.0 / 250;
    }
    if (seed % 13 == 5) {
        f->plan.mode = LUMI_PLAN_VIDEO;
        f->plan.bracket = 1;
        f->plan.turn_time = 10;
        f->rig.control.video.record_pulse = seed % 2 ? 0.1 : 0;
    }
    sim_machine_options_init(&f->options, &f->rig);
    f->options.mechanics.video = f->plan.mode == LUMI_PLAN_VIDEO;
    f->options.seed = (uint64_t)seed;
    /* Main loops of 20 µs, 1 ms and 2 ms: only interrupts are on time. */
    f->options.loop_latency =
        seed / 3 % 3 == 0 ? BOARD_TICK_HZ / 50000 : (uint32_t)(seed / 3 % 3) * (BOARD_TICK_HZ / 1000);
    f->options.loop_longest = BOARD_TICK_HZ / 20;
    f->options.link = seed % 2 ? BOARD_LINK_USB : BOARD_LINK_SERIAL;
    if (f->options.link == BOARD_LINK_SERIAL)
        f->options.link_rate = 11520;
}

/* Without a brake an arm on its string falls whenever the motor has no current, and with one where the driver's fault
 * does not reach the board: no firmware can help that. */
static void spare_the_arm(struct rig_operator *o)
{
    bool braked = o->f.rig.string.held || o->f.rig.control.safety.brake_fitted, deaf = false;
    int kept = 0;

    for (int i = 0; i < o->script.count; i++)
        deaf |= o->script.faults[i].kind == SIM_FAULT_INPUT && o->script.faults[i].index == BOARD_IN_DRIVER_FAULT;
    for (int i = 0; i < o->script.count; i++) {
        enum sim_fault_kind kind = o->script.faults[i].kind;
        bool driver = kind == SIM_FAULT_DRIVER, power = kind == SIM_FAULT_SUPPLY || kind == SIM_FAULT_POWER;
        if (braked ? !(driver && deaf) : !driver && !power)
            o->script.faults[kept++] = o->script.faults[i];
    }
    o->script.count = kept;
}

static bool one_day(int seed)
{
    static char text[65536];
    struct rig_operator *o = calloc(1, sizeof *o);
    struct lumi_error error = {0};
    bool good;

    choose(o, seed);
    assert_int_equal(lumi_plan_check(&o->f.plan, &o->f.rig, NULL), LUMI_OK);
    sim_fault_script_random(&o->script, (uint64_t)seed, &o->f.rig, 6, 40);
    spare_the_arm(o);
    o->f.machine = sim_machine_create(&o->f.rig, &o->f.options);
    assert_non_null(o->f.machine);
    if (sim_machine_configure(o->f.machine, &o->f.rig, &error) != LUMI_OK ||
        sim_machine_home(o->f.machine, !o->f.rig.string.held, 0, &error) != LUMI_OK)
        fail_msg("seed %d: %s", seed, error.text);
    sim_machine_set_faults(o->f.machine, &o->script);
    good = rig_operator_run(o, 600) && rig_operator_judge(o);
    if (!good) {
        sim_fault_script_print(&o->script, text, sizeof text);
        print_message("seed %d (%s, %s): %s\n%s", seed, o->f.rig.name,
                      o->f.plan.mode == LUMI_PLAN_VIDEO        ? "video"
                      : o->f.plan.mode == LUMI_PLAN_START_STOP ? "start-stop"
                                                               : "continuous",
                      o->why, text);
    }
    sim_machine_destroy(o->f.machine);
    free(o);
    return good;
}

static void no_random_day_loses_doubles_or_endangers_anything(void **state)
{
    int bad = 0;

    (void)state;
    for (int seed = first_seed; seed < first_seed + seeds; seed++)
        bad += !one_day(seed);
    print_message("%d fault scripts, %d bad\n", seeds, bad);
    assert_int_equal(bad, 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_random_day_loses_doubles_or_endangers_anything),
    };
    const char *count = getenv("LUMI_FAULTS_COUNT");

    if (argc > 1 || count)
        seeds = atoi(argc > 1 ? argv[1] : count);
    if (argc > 2)
        first_seed = atoi(argv[2]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
