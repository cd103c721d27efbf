/* The board as a whole: what it accepts when, what it refuses, what it stores, how it tells. */
#include "tests/unit/core_bench.h"

static void a_board_without_profile_answers_and_moves_nothing(void **state)
{
    struct bench *b = bench_create(NULL);

    (void)state;
    assert_int_equal(b->core->state, lumi_wire_State_NO_PROFILE);
    assert_int_equal(b->starts, 1);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(get_status, 0)), lumi_wire_Result_DONE);
    assert_int_equal(b->reply.which_payload, lumi_wire_Reply_status_tag);
    assert_int_equal(b->reply.payload.status.state, lumi_wire_State_NO_PROFILE);
    assert_string_equal(b->client.welcome.board, "host");
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, 0)), lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "home: not while the rig is without a profile");
    assert_int_equal(bench_ask(b, BENCH_REQUEST(read_profile, 0)), lumi_wire_Result_REFUSED);
    assert_int_equal(host_board_counts(b->board)->steps, 0);
    bench_destroy(b);
}

static void with_the_position_lost_only_homing_moves(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    lumi_plan_init(&plan, &rig);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    uint32_t crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(pause, 0)), lumi_wire_Result_REFUSED);
    bench_run(b, 2);
    assert_int_equal(host_board_counts(b->board)->steps, 0);
    bench_home(b);
    int64_t off = b->position - motion_position(&b->core->motion);
    assert_in_range(off + 1, 0, 2);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(jog, .turns = 0.1)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 10);
    bench_run(b, 5);
    assert_int_equal(b->position, motion_position(&b->core->motion) + off);
    bench_destroy(b);
}

static void upload(struct bench *b, const uint8_t *data, size_t size)
{
    lumi_wire_Request write = {.which_command = lumi_wire_Request_write_profile_tag};

    for (size_t at = 0; at < size; at += 256) {
        size_t part = size - at < 256 ? size - at : 256;
        write.command.write_profile.offset = (uint32_t)at;
        write.command.write_profile.data.size = (pb_size_t)part;
        memcpy(write.command.write_profile.data.bytes, data + at, part);
        assert_int_equal(bench_ask(b, &write), lumi_wire_Result_DONE);
    }
}

static void a_newer_firmware_s_profile_is_replaced_only_when_that_is_said(void **state)
{
    static lumi_wire_Profile scratch;
    uint32_t newer[9] = {0x50524c4c, 2, 9, 4, 0, UINT32_MAX, UINT32_MAX, UINT32_MAX, 0x12345678};
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(NULL);
    const struct board *port = host_board_port(b->board);
    newer[4] = lumi_crc32c(lumi_crc32c(0, &newer[1], 12), &newer[8], 4);
    assert_true(port->flash_erase(port->port, 1));
    assert_true(port->flash_write(port->port, 1, 0, (const uint8_t *)newer, sizeof newer));
    size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
    uint32_t crc = lumi_crc32c(0, data, size);
    upload(b, data, size);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(commit_profile, .size = (uint32_t)size, .crc = crc)),
                     lumi_wire_Result_FAILED);
    assert_non_null(strstr(b->reply.text, "a newer firmware"));
    assert_int_equal(b->core->state, lumi_wire_State_NO_PROFILE);
    upload(b, data, size);
    assert_int_equal(
        bench_ask(b, BENCH_REQUEST(commit_profile, .size = (uint32_t)size, .crc = crc, .replace_newer = true)),
        lumi_wire_Result_DONE);
    assert_string_equal(b->core->rig.name, "bar2");
    bench_destroy(b);
}

static void a_profile_is_taken_whole_or_not_at_all(void **state)
{
    struct lumi_rig rig;
    static lumi_wire_Profile scratch;
    uint8_t data[LUMI_WIRE_PROFILE_MAX];
    lumi_wire_Request write = {.which_command = lumi_wire_Request_write_profile_tag};

    (void)state;
    assert_int_equal(lumi_rig_builtin("bar2", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(NULL);
    size_t size = lumi_wire_encode_profile(&rig, &scratch, data, sizeof data);
    uint32_t crc = lumi_crc32c(0, data, size);
    upload(b, data, size);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(commit_profile, .size = (uint32_t)size, .crc = crc + 1)),
                     lumi_wire_Result_BAD);
    assert_int_equal(b->core->state, lumi_wire_State_NO_PROFILE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(commit_profile, .size = (uint32_t)size, .crc = crc)),
                     lumi_wire_Result_DONE);
    assert_int_equal(b->core->state, lumi_wire_State_LOST);
    assert_string_equal(b->core->rig.name, "bar2");
    for (size_t at = 0; at < size; at += 256) {
        assert_int_equal(bench_ask(b, BENCH_REQUEST(read_profile, .offset = (uint32_t)at)), lumi_wire_Result_DONE);
        const lumi_wire_ProfilePart *part = &b->reply.payload.profile;
        assert_int_equal(part->size, size);
        assert_int_equal(part->crc, crc);
        assert_memory_equal(part->data.bytes, data + at, part->data.size);
    }
    /* One that cannot be: the board keeps what it had. */
    write.command.write_profile.offset = 0;
    write.command.write_profile.data.size = 3;
    memcpy(write.command.write_profile.data.bytes, "\x08\x01\x00", 3);
    assert_int_equal(bench_ask(b, &write), lumi_wire_Result_DONE);
    crc = lumi_crc32c(0, (const uint8_t *)"\x08\x01\x00", 3);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(commit_profile, .size = 3, .crc = crc)), lumi_wire_Result_BAD);
    assert_true(b->core->has_profile);
    assert_string_equal(b->core->rig.name, "bar2");
    bench_destroy(b);
}

static void a_plan_that_cannot_be_or_another_one_is_refused(void **state)
{
    struct lumi_rig rig;
    struct lumi_plan plan;
    lumi_wire_Request load = {.which_command = lumi_wire_Request_load_plan_tag};

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    bench_home(b);
    lumi_plan_init(&plan, &rig);
    plan.turn_time = 5; /* blurs */
    load.command.load_plan.has_plan = true;
    lumi_wire_from_plan(&plan, &load.command.load_plan.plan);
    assert_int_equal(bench_ask(b, &load), lumi_wire_Result_BAD);
    assert_true(strlen(b->reply.text) > 10);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, 0)), lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "start: no plan is loaded");
    plan.turn_time = 30;
    uint32_t crc = bench_load(b, &plan);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc + 1)), lumi_wire_Result_REFUSED);
    assert_string_equal(b->reply.text, "start: another plan is loaded");
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc, .first_shot = 72)),
                     lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(start_sweep, .plan_crc = crc)), lumi_wire_Result_DONE);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(enter_loader, 0)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(commit_profile, 0)), lumi_wire_Result_REFUSED);
    assert_int_equal(bench_ask(b, &load), lumi_wire_Result_REFUSED);
    assert_int_equal(host_board_counts(b->board)->loader, 0);
    bench_destroy(b);
}

static void triggers_are_tested_one_after_another(void **state)
{
    struct lumi_rig rig;

    (void)state;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, NULL), LUMI_OK);
    struct bench *b = bench_create(&rig);
    assert_int_equal(bench_ask(b, BENCH_REQUEST(test_triggers, .cameras = 0x0421, .exposure = 0.01, .gap = 0.2)),
                     lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_LOST, 5);
    assert_int_equal(b->edge_count, 6);
    const int channels[] = {0, 5, 10};
    for (int i = 0; i < 3; i++) {
        uint16_t line = (uint16_t)(1u << rig.control.triggers[channels[i]].channel);
        assert_int_equal(b->edges[2 * i].rise, line);
        assert_int_equal(b->edges[2 * i + 1].fall, line);
        uint64_t pulse = (uint64_t)(rig.control.triggers[channels[i]].pulse * BOARD_TICK_HZ + 0.5);
        assert_int_equal(b->edges[2 * i + 1].at - b->edges[2 * i].at, pulse);
    }
    assert_int_equal(b->fired + b->lost, 0);
    bench_destroy(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_board_without_profile_answers_and_moves_nothing),
        cmocka_unit_test(with_the_position_lost_only_homing_moves),
        cmocka_unit_test(a_profile_is_taken_whole_or_not_at_all),
        cmocka_unit_test(a_newer_firmware_s_profile_is_replaced_only_when_that_is_said),
        cmocka_unit_test(a_plan_that_cannot_be_or_another_one_is_refused),
        cmocka_unit_test(triggers_are_tested_one_after_another),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
