/* Frames on the sphere, the arm, jog, the rig's profile and plans over the API; two who press start at once. */
#include "daemon/http/api_json.h"
#include "tests/unit/api_fixture.h"

static JsonParser *parser;

static JsonObject *ask(void *fixture, const char *method, const char *path, const char *body, int status)
{
    struct answer answer = fixture_ask(fixture, method, path, body ? JSON_TYPE : NULL, body);

    if (answer.status != status)
        fail_msg("%s: %d %s", path, answer.status, answer.body);
    assert_true(json_parser_load_from_data(parser, answer.body, -1, NULL));
    answer_clear(&answer);
    return json_node_get_object(json_parser_get_root(parser));
}

static int set_up(void **state)
{
    parser = json_parser_new();
    return fixture_set_up(state);
}

static int tear_down(void **state)
{
    g_object_unref(parser);
    return fixture_tear_down(state);
}

static void know_a_rig(void)
{
    assert_int_equal(lumi_rig_builtin("arc16", &engine_double.rig, NULL), LUMI_OK);
    engine_double.rig_source = "board";
}

static void before_a_capture_there_are_no_frames(void **state)
{
    JsonObject *frames = ask(*state, "GET", "/api/v1/capture/frames", NULL, 200);

    assert_string_equal(json_object_get_string_member(frames, "capture"), "");
    assert_string_equal(json_object_get_string_member(frames, "letters"), "");
    assert_int_equal(json_array_get_length(json_object_get_array_member(frames, "names")), 0);
}

static void frames_have_a_name_a_direction_and_a_letter_each(void **state)
{
    engine_double.frames = (struct lumi_engine_frames){.capture = "/c/\"hall\"", .shots = 3, .camera_count = 1};
    JsonObject *frames = ask(*state, "GET", "/api/v1/capture/frames", NULL, 200);
    JsonArray *directions = json_object_get_array_member(frames, "directions");
    JsonArray *names = json_object_get_array_member(frames, "names");

    assert_string_equal(json_object_get_string_member(frames, "capture"), "/c/\"hall\"");
    assert_string_equal(json_object_get_string_member(frames, "letters"), "apn");
    assert_string_equal(json_array_get_string_element(json_object_get_array_member(frames, "cameras"), 0), "c00");
    assert_string_equal(json_array_get_string_element(names, 2), "c00-t00-p001.2");
    static const double wanted[3][3] = {{1, 0, 0}, {-0.6, 0, 0.8}, {0.1234, -0.1235, 1}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            assert_float_equal(
                json_array_get_double_element(json_array_get_array_element(directions, (guint)i), (guint)k),
                wanted[i][k], 1e-9);
}

static void the_arm_and_the_disk_are_told_where_they_are_known(void **state)
{
    struct lumi_engine_status *status = &engine_double.status;
    JsonObject *capture = ask(*state, "GET", "/api/v1/capture", NULL, 200);

    assert_true(json_object_get_null_member(capture, "arm"));
    assert_true(json_object_get_null_member(capture, "disk_seconds_left"));
    status->arm = (struct lumi_engine_arm){
        .known = true, .turn_known = true, .turn = 1.25, .yaw = -0.5, .pitch = 0.1, .camera_count = 1};
    status->arm.cameras[0][2] = 1;
    status->store.bytes_per_second = 1e6;
    status->disk_free_bytes = 5000000;
    capture = ask(*state, "GET", "/api/v1/capture", NULL, 200);
    JsonObject *arm = json_object_get_object_member(capture, "arm");
    assert_float_equal(json_object_get_double_member(arm, "turn"), 1.25, 1e-9);
    assert_float_equal(json_object_get_double_member(arm, "yaw"), -0.5, 1e-9);
    assert_float_equal(json_object_get_double_member(arm, "pitch"), 0.1, 1e-9);
    assert_float_equal(json_object_get_double_member(capture, "disk_seconds_left"), 5, 1e-9);
    status->arm.turn_known = false; /* how far it has fallen is not known then either */
    arm = json_object_get_object_member(ask(*state, "GET", "/api/v1/capture", NULL, 200), "arm");
    assert_true(json_object_get_null_member(arm, "turn"));
    assert_true(json_object_get_null_member(arm, "pitch"));
    assert_int_equal(json_array_get_length(json_object_get_array_member(arm, "cameras")), 0);
}

static void a_jog_is_in_degrees_and_bounded(void **state)
{
    ask(*state, "POST", "/api/v1/capture/jog", "{\"degrees\":-90}", 202);
    assert_string_equal(engine_double.call, "jog");
    assert_float_equal(engine_double.radians, -LUMI_PI / 2, 1e-9);
    ask(*state, "POST", "/api/v1/capture/jog", "{\"degrees\":361}", 422);
    ask(*state, "POST", "/api/v1/capture/jog", "{}", 422);
    assert_int_equal(engine_double.calls, 1);
}

static void without_a_rig_nothing_is_said_of_plans(void **state)
{
    ask(*state, "GET", "/api/v1/profile", NULL, 409);
    ask(*state, "GET", "/api/v1/plans", NULL, 409);
    ask(*state, "POST", "/api/v1/plans/check", "{\"plan\":\"[sweep]\\n\"}", 409);
}

static void plans_to_begin_with_can_be_run_by_the_rig(void **state)
{
    know_a_rig();
    JsonObject *profile = ask(*state, "GET", "/api/v1/profile", NULL, 200);
    assert_string_equal(json_object_get_string_member(profile, "source"), "board");
    assert_float_equal(json_object_get_double_member(profile, "radius_m"), 0.35, 1e-9);
    JsonArray *plans = json_object_get_array_member(ask(*state, "GET", "/api/v1/plans", NULL, 200), "plans");
    const guint count = json_array_get_length(plans);
    assert_true(count >= 3);
    g_autoptr(JsonArray) kept = json_array_ref(plans);
    engine_double.status.camera_count = 16;
    for (int i = 0; i < 16; i++)
        snprintf(engine_double.status.cameras[i].name, LUMI_RIG_NAME, "%s", engine_double.rig.cameras[i].name);
    for (guint i = 0; i < count; i++) {
        g_autoptr(JsonBuilder) body = json_builder_new();
        json_builder_begin_object(body);
        lumi_api_put_text(body, "plan", json_object_get_string_member(json_array_get_object_element(kept, i), "text"));
        json_builder_end_object(body);
        g_autofree char *text = lumi_api_finish(body);
        JsonObject *checked = ask(*state, "POST", "/api/v1/plans/check", text, 200);
        assert_true(json_object_get_boolean_member(checked, "runnable"));
        assert_float_equal(json_object_get_double_member(checked, "view_volume_m"), 0.2867, 1e-3);
        assert_true(json_object_get_double_member(checked, "nearest_sharp_m") > 0.3);
    }
}

static void what_cannot_be_run_is_said_before_anything_turns(void **state)
{
    know_a_rig();
    JsonObject *checked =
        ask(*state, "POST", "/api/v1/plans/check", "{\"plan\":\"[sweep]\\nexposure_s = 1/30\\n\"}", 200);
    assert_false(json_object_get_boolean_member(checked, "runnable"));
    JsonObject *problem = json_array_get_object_element(json_object_get_array_member(checked, "problems"), 0);
    assert_int_equal(json_object_get_int_member(problem, "line"), 2);
    assert_true(json_object_get_null_member(checked, "seconds"));
    /* The rig could, and lumid has no such camera. */
    checked = ask(*state, "POST", "/api/v1/plans/check", "{\"plan\":\"[sweep]\\n\"}", 200);
    assert_false(json_object_get_boolean_member(checked, "runnable"));
    problem = json_array_get_object_element(json_object_get_array_member(checked, "problems"), 0);
    assert_non_null(strstr(json_object_get_string_member(problem, "text"), "is not configured"));
    assert_int_equal(json_object_get_int_member(checked, "frames"), 1152);
    ask(*state, "POST", "/api/v1/plans/check", "{\"plan\":\"[sweep]\\n\",\"profile\":\"nonsense\"}", 422);
    assert_int_equal(engine_double.calls, 0); /* nobody was asked to do anything */
}

static void of_two_who_press_start_at_once_one_is_told_why_not(void **state)
{
    static const char body[] = "{\"plan\":\"[sweep]\\n\"}";
    g_autofree char *request = g_strdup_printf("POST /api/v1/capture/start HTTP/1.1\r\nHost: localhost\r\n" JSON_TYPE
                                               "Connection: close\r\nContent-Length: %zu\r\n\r\n%s",
                                               strlen(body), body);
    int fds[2], started = 0, refused = 0;

    engine_double.one_start = true;
    for (int i = 0; i < 2; i++)
        fds[i] = fixture_connect(*state);
    for (int i = 0; i < 2; i++)
        fixture_send(fds[i], request, strlen(request));
    for (int i = 0; i < 2; i++) {
        struct answer answer = answer_of(fixture_receive(fds[i], NULL));
        started += answer.status == 202;
        refused += answer.status == 409 && strstr(answer.body, "another capture is under way");
        answer_clear(&answer);
        close(fds[i]);
    }
    assert_int_equal(started, 1);
    assert_int_equal(refused, 1);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(before_a_capture_there_are_no_frames),
        CASE(frames_have_a_name_a_direction_and_a_letter_each),
        CASE(the_arm_and_the_disk_are_told_where_they_are_known),
        CASE(a_jog_is_in_degrees_and_bounded),
        CASE(without_a_rig_nothing_is_said_of_plans),
        CASE(plans_to_begin_with_can_be_run_by_the_rig),
        CASE(what_cannot_be_run_is_said_before_anything_turns),
        CASE(of_two_who_press_start_at_once_one_is_told_why_not),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
