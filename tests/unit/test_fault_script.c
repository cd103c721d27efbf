/* sim/rig: fault scripts are read, refused with their line, and printed again. */
#include "sim/rig/faults.h"

#include "firmware/board/board.h"
#include "sim/rig/mechanics.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static int parse(const char *text, struct sim_fault_script *script, struct lumi_error *error)
{
    return sim_fault_script_parse(text, strlen(text), "day.faults", script, error);
}

static void a_script_says_when_what_and_for_how_long(void **state)
{
    static struct sim_fault_script script;

    (void)state;
    assert_int_equal(parse("# a bad day\n"
                           "at 12.5s estop press for 250ms\n"
                           "\n"
                           "  at shot 300 link cut for 3s # tripped over\n"
                           "at 0s input string-end stuck-on\n"
                           "at 1s camera 7 lag 20ms\r\n"
                           "at 2s reset watchdog",
                           &script, NULL),
                     0);
    assert_int_equal(script.count, 5);
    assert_true(script.faults[0].kind == SIM_FAULT_ESTOP && script.faults[0].value == 1);
    assert_true(script.faults[0].at == 12.5 && script.faults[0].duration == 0.25 && !script.faults[0].by_shot);
    assert_true(script.faults[1].by_shot && script.faults[1].at == 300 && script.faults[1].duration == 3);
    assert_true(script.faults[2].index == BOARD_IN_STRING_END && script.faults[2].value == SIM_FORCE_ACTIVE);
    assert_true(script.faults[3].kind == SIM_FAULT_CAMERA_LAG && script.faults[3].index == 7);
    assert_true(script.faults[3].value == 0.02);
    assert_true(script.faults[4].kind == SIM_FAULT_RESET && script.faults[4].index == BOARD_RESET_WATCHDOG);
}

static void what_is_no_fault_is_refused_with_its_line(void **state)
{
    static const char *const bad[] = {
        "estop press",          "at 1 estop press",       "at 1s estop",           "at -1s estop press",
        "at nans estop press",  "at shot 1s estop press", "at 1s estop press for", "at 1s estop press for 0s",
        "at 1s camera 16 dead", "at 1s camera 0.5 dead",  "at 1s supply 9",        "at 1s input door stuck-on",
        "at 1s link noise 2",   "at 1s reset twice",      "at 1s supply 1e999V",
    };
    static struct sim_fault_script script;
    char text[128];

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lumi_error error = {0};
        snprintf(text, sizeof text, "at 1s string snag\n\n%s\n", bad[i]);
        assert_int_equal(parse(text, &script, &error), LUMI_ERR_FORMAT);
        assert_non_null(strstr(error.text, "day.faults: line 3: "));
    }
}

static void random_scripts_are_printed_and_read_back(void **state)
{
    static struct sim_fault_script script, back;
    static char text[65536];
    struct lumi_rig rig;
    int kinds[SIM_FAULT_KINDS] = {0};

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), 0);
    for (uint64_t seed = 0; seed < 200; seed++) {
        sim_fault_script_random(&script, seed, &rig, 6, 60);
        assert_in_range(script.count, 1, 6);
        assert_in_range(sim_fault_script_print(&script, text, sizeof text), 1, sizeof text - 1);
        assert_int_equal(parse(text, &back, NULL), 0);
        assert_int_equal(back.count, script.count);
        assert_memory_equal(back.faults, script.faults, (size_t)script.count * sizeof script.faults[0]);
        for (int i = 0; i < script.count; i++)
            kinds[script.faults[i].kind]++;
    }
    for (int kind = 0; kind < SIM_FAULT_CUT_IN_FLASH; kind++)
        assert_true(kinds[kind] > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_script_says_when_what_and_for_how_long),
        cmocka_unit_test(what_is_no_fault_is_refused_with_its_line),
        cmocka_unit_test(random_scripts_are_printed_and_read_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
