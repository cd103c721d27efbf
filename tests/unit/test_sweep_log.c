/* daemon/rig/sweep_log, sweep_run's texts: what is written of a sweep, and read again. */
#include "daemon/rig/sweep_run.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char folder[] = "/tmp/lumi-log-XXXXXX";
static char path[64];
static struct lumi_rig rig;
static struct lumi_plan plan;

static uint64_t to_host(void *context, uint64_t board_ns)
{
    (void)context;
    return board_ns + 1000;
}

static const struct lumi_rig_json_clock clock_of_boot = {
    .boot = 4000000000u, .utc_offset_ns = 5000, .to_host = to_host};

static struct lumi_rig_notice shot(uint32_t event, uint32_t number, bool lost)
{
    struct lumi_rig_notice notice = {.kind = LUMI_RIG_NOTICE_EVENT};

    notice.event.number = event;
    notice.event.time_ns = 123456789;
    notice.event.which_kind = lumi_wire_Event_shot_tag;
    notice.event.kind.shot = (lumi_wire_Shot){.number = number,
                                              .lost = lost,
                                              .channels = 0x8001,
                                              .step = 12.25,
                                              .turn = 1,
                                              .pitch = 0.5,
                                              .middle_ns = 123000000,
                                              .edge_ns_count = 2,
                                              .edge_ns = {-2000000, 30}};
    return notice;
}

static void write_log(int shots)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};

    unlink(path);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, false, &plan, &rig, &error), LUMI_OK);
    for (int i = 0; i < shots; i++) {
        struct lumi_rig_notice notice = shot((uint32_t)(10 + i), (uint32_t)i, i == 2);
        assert_int_equal(lumi_rig_sweep_log_notice(&log, &notice, &clock_of_boot, &error), LUMI_OK);
        assert_int_equal(lumi_rig_sweep_log_notice(&log, &notice, &clock_of_boot, &error), LUMI_OK); /* once */
    }
    assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
}

static int count_lines(void)
{
    uint8_t *text;
    size_t size;
    int lines = 0;

    assert_int_equal(lumi_file_read(path, 1 << 20, &text, &size, NULL), LUMI_OK);
    for (size_t i = 0; i < size; i++)
        lines += text[i] == '\n';
    assert_true(size && text[size - 1] == '\n');
    lumi_free(text);
    return lines;
}

static void a_shot_is_one_line_with_all_its_times(void **state)
{
    char text[LUMI_RIG_EVENT_TEXT_MAX];
    struct lumi_rig_notice notice = shot(7, 41, false);

    (void)state;
    lumi_rig_notice_json(&notice, &clock_of_boot, text, sizeof text);
    assert_string_equal(text,
                        "{\"boot\":4000000000,\"event\":7,\"at_board_ns\":123456789,\"at_host_ns\":123457789,"
                        "\"at_utc_ns\":123462789,\"shot\":41,\"lost\":false,\"bracket\":0,\"turn\":1,\"step\":12.25,"
                        "\"pitch\":0.5,\"middle_board_ns\":123000000,\"middle_host_ns\":123001000,"
                        "\"middle_utc_ns\":123006000,\"edges\":[{\"channel\":0,\"after_middle_ns\":-2000000},"
                        "{\"channel\":15,\"after_middle_ns\":30}]}");
}

static void texts_of_the_board_cannot_break_out_of_their_line(void **state)
{
    struct lumi_rig_notice notice = {.kind = LUMI_RIG_NOTICE_EVENT};
    char text[LUMI_RIG_EVENT_TEXT_MAX];
    struct lumi_rig_log_line line;

    (void)state;
    notice.event.which_kind = lumi_wire_Event_note_tag;
    snprintf(notice.event.kind.note.text, sizeof notice.event.kind.note.text, "a\"shot\":5,\\\n\"lost\":false");
    lumi_rig_notice_json(&notice, &clock_of_boot, text, sizeof text);
    assert_non_null(strstr(text, "a\\\"shot\\\":5,\\\\\\u000a\\\"lost\\\":false"));
    lumi_rig_log_line_parse(text, strlen(text), &line);
    assert_false(line.has_shot);
    assert_true(line.has_boot && line.boot == 4000000000u);
}

static void what_is_written_is_known_when_it_is_opened_again(void **state)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};

    (void)state;
    write_log(5);
    assert_int_equal(count_lines(), 6);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
    for (uint32_t i = 0; i < 8; i++)
        assert_int_equal(lumi_rig_sweep_log_has(&log, i), i < 5 && i != 2);
    struct lumi_rig_notice old = shot(14, 4, false), fresh = shot(15, 5, false);
    assert_int_equal(lumi_rig_sweep_log_notice(&log, &old, &clock_of_boot, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_notice(&log, &fresh, &clock_of_boot, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_shot(&log, 6, 4000000000u, &error), LUMI_OK);
    lumi_rig_sweep_log_close(&log, &error);
    assert_int_equal(count_lines(), 8);
}

static void a_torn_line_is_dropped(void **state)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};
    uint8_t *text;
    size_t size;

    (void)state;
    write_log(5);
    assert_int_equal(lumi_file_read(path, 1 << 20, &text, &size, &error), LUMI_OK);
    lumi_free(text);
    assert_false(truncate(path, (off_t)size - 20));
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
    assert_true(lumi_rig_sweep_log_has(&log, 3));
    assert_false(lumi_rig_sweep_log_has(&log, 4));
    struct lumi_rig_notice again = shot(14, 4, false);
    assert_int_equal(lumi_rig_sweep_log_notice(&log, &again, &clock_of_boot, &error), LUMI_OK);
    lumi_rig_sweep_log_close(&log, &error);
    assert_int_equal(count_lines(), 6);
}

static void other_files_are_not_gone_on_with(void **state)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};
    struct lumi_plan other = plan;

    (void)state;
    write_log(1);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, false, &plan, &rig, &error), LUMI_ERR_EXISTS);
    other.turn_time += 1;
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &other, &rig, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "another plan"));
    assert_int_equal(lumi_file_write(path, "hello\n", 6, false, NULL), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_file_write(path, "{\"log\":\"mine\"", 13, false, NULL), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_ERR_FORMAT);
}

static void a_log_whose_first_line_was_torn_is_begun_anew(void **state)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};
    uint8_t *text;
    size_t size;

    (void)state;
    for (size_t left = 0; left < 120; left += 7) {
        write_log(0);
        assert_int_equal(lumi_rig_sweep_log_open(&log, path, false, &plan, &rig, &error), LUMI_OK);
        struct lumi_rig_notice first = shot(10, 0, false);
        assert_int_equal(lumi_rig_sweep_log_notice(&log, &first, &clock_of_boot, &error), LUMI_OK);
        assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
        assert_int_equal(lumi_file_read(path, 1 << 20, &text, &size, &error), LUMI_OK);
        size_t line = (size_t)((uint8_t *)memchr(text, '\n', size) - text);
        lumi_free(text);
        assert_false(truncate(path, (off_t)(left < line ? left : line)));
        if (left % 2)
            assert_false(truncate(path, 200)); /* zeros */
        assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
        assert_true(log.anew);
        assert_false(lumi_rig_sweep_log_has(&log, 0));
        assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
        assert_int_equal(count_lines(), 1);
        assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
        assert_false(log.anew);
        assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
    }
}

static void a_log_in_which_nothing_came_to_stand_goes_again(void **state)
{
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};

    (void)state;
    unlink(path);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
    assert_int_equal(access(path, F_OK), -1);
    write_log(1);
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
    assert_int_equal(access(path, F_OK), 0);
}

static void how_the_clocks_stood_is_written_when_it_is_known(void **state)
{
    struct lumi_rig_link_snapshot link = {.clock_matched = true,
                                          .clock_offset_ns = -29248636439,
                                          .clock_drift_ppm = -12.3456,
                                          .clock_residual_ns = 4711.2,
                                          .round_trip_ns = 1e6};
    struct lumi_rig_sweep_log log;
    struct lumi_error error = {0};
    uint8_t *text;
    size_t size;

    (void)state;
    link.welcome.boot = 7;
    write_log(1);
    int before = count_lines();
    assert_int_equal(lumi_rig_sweep_log_open(&log, path, true, &plan, &rig, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_clock(&log, &link, &error), LUMI_OK); /* too young to tell */
    link.clock_drift_known = true;
    assert_int_equal(lumi_rig_sweep_log_clock(&log, &link, &error), LUMI_OK);
    assert_int_equal(lumi_rig_sweep_log_close(&log, &error), LUMI_OK);
    assert_int_equal(count_lines(), before + 1);
    assert_int_equal(lumi_file_read(path, 1 << 20, &text, &size, &error), LUMI_OK);
    assert_non_null(strstr((char *)text, "{\"boot\":7,\"clock_offset_ns\":-29248636439,\"clock_drift_ppb\":-12346,"
                                         "\"clock_residual_ns\":4711,\"round_trip_ns\":1000000}\n"));
    lumi_free(text);
}

static void missing_shots_are_named_as_ranges(void **state)
{
    uint8_t states[300];
    char text[200];

    (void)state;
    memset(states, 1, sizeof states);
    lumi_rig_missing_text(states, 300, text, sizeof text);
    assert_string_equal(text, "");
    states[3] = 0;
    for (int i = 17; i < 25; i++)
        states[i] = (uint8_t)(i % 2 * 2);
    states[299] = 2;
    lumi_rig_missing_text(states, 300, text, sizeof text);
    assert_string_equal(text, "3, 17-24, 299");
    for (int i = 0; i < 300; i += 2)
        states[i] = 0;
    lumi_rig_missing_text(states, 300, text, sizeof text);
    assert_non_null(strstr(text, ", ..."));
}

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder) || lumi_rig_builtin("arc16", &rig, NULL))
        return -1;
    lumi_plan_init(&plan, &rig);
    snprintf(path, sizeof path, "%s/log", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_shot_is_one_line_with_all_its_times),
        cmocka_unit_test(texts_of_the_board_cannot_break_out_of_their_line),
        cmocka_unit_test(what_is_written_is_known_when_it_is_opened_again),
        cmocka_unit_test(a_torn_line_is_dropped),
        cmocka_unit_test(other_files_are_not_gone_on_with),
        cmocka_unit_test(a_log_whose_first_line_was_torn_is_begun_anew),
        cmocka_unit_test(a_log_in_which_nothing_came_to_stand_goes_again),
        cmocka_unit_test(how_the_clocks_stood_is_written_when_it_is_known),
        cmocka_unit_test(missing_shots_are_named_as_ranges),
    };

    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
