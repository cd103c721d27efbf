/* daemon/http: routes, who may ask, limits. */
#include "tests/unit/api_fixture.h"

static void expect(struct answer answer, int status, const char *part)
{
    if (answer.status != status || (part && !strstr(answer.body, part)))
        fail_msg("%d wanted with %s, came %d: %s", status, part ? part : "anything", answer.status, answer.body);
    if (status >= 400) {
        assert_non_null(strstr(answer.head, "Content-Type: application/problem+json\r\n"));
        assert_non_null(strstr(answer.body, "\"type\":\"urn:lumid:"));
    }
    answer_clear(&answer);
}

static void status_is_one_object(void **state)
{
    expect(fixture_ask(*state, "GET", "/api/v1/status", NULL, NULL), 200, "\"name\":\"link\"");
}

static void what_is_not_there_is_a_problem_document(void **state)
{
    expect(fixture_ask(*state, "GET", "/nothing", NULL, NULL), 404, "urn:lumid:path");
    expect(fixture_ask(*state, "GET", "/api/v1/status/", NULL, NULL), 404, NULL);
    expect(fixture_ask(*state, "GET", "/%2e%2e/etc/passwd", NULL, NULL), 404, NULL);
    struct answer answer = fixture_ask(*state, "DELETE", "/api/v1/processing", NULL, NULL);
    assert_non_null(strstr(answer.head, "Allow: GET, POST\r\n"));
    expect(answer, 405, "urn:lumid:method");
}

static void a_start_reaches_the_engine(void **state)
{
    expect(fixture_ask(*state, "POST", "/api/v1/capture/start", JSON_TYPE,
                       "{\"plan\":\"[plan]\\n\",\"override\":[\"disk\",\"blur\"],\"title\":\"T\"}"),
           202, "\"state\":\"preflight\"");
    assert_string_equal(engine_double.plan, "[plan]\n");
    assert_string_equal(engine_double.first, "disk");
    assert_int_equal(engine_double.count, 2);
    assert_string_equal(engine_double.title, "T");
    assert_string_equal(engine_double.name, "");
    assert_false(engine_double.preflight_only);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/preflight", JSON_TYPE, "{\"plan\":\"p\"}"), 202, NULL);
    assert_true(engine_double.preflight_only);
    assert_false(engine_double.has_override);
}

static void a_body_that_is_wrong_changes_nothing(void **state)
{
    static const struct {
        const char *body;
        int status;
        const char *part;
    } bad[] = {
        {"{\"plan\":", 400, "byte 8"},
        {"[]", 422, "no object"},
        {"{}", 422, "'plan' is missing"},
        {"{\"plan\":1}", 422, "'plan': a string"},
        {"{\"plan\":null}", 422, "'plan' is missing"},
        {"{\"plan\":\"p\",\"speed\":1}", 422, "'speed'"},
        {"{\"plan\":\"p\",\"override\":\"disk\"}", 422, "'override'"},
        {"{\"plan\":\"p\",\"override\":[1]}", 422, "element 0"},
        {"{\"plan\":\"p\"} x", 400, NULL},
        {"// c\n{\"plan\":\"p\"}", 400, NULL},
    };

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        expect(fixture_ask(*state, "POST", "/api/v1/capture/start", JSON_TYPE, bad[i].body), bad[i].status,
               bad[i].part);
    g_autofree char *long_name = g_strnfill(300, 'n');
    g_autofree char *body = g_strdup_printf("{\"plan\":\"p\",\"name\":\"%s\"}", long_name);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/start", JSON_TYPE, body), 422, "300 bytes, 255");
    GString *deep = g_string_new("{\"plan\":");
    for (int i = 0; i < 100000; i++)
        g_string_append_c(deep, '[');
    expect(fixture_ask(*state, "POST", "/api/v1/capture/start", JSON_TYPE, deep->str), 400, NULL);
    g_string_free(deep, TRUE);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/start", "Content-Type: text/plain\r\n", "{\"plan\":\"p\"}"),
           415, NULL);
    assert_int_equal(engine_double.calls, 0);
}

static void what_the_engine_refuses_is_said_in_its_words(void **state)
{
    engine_double.code = LUMI_ERR_BUSY;
    snprintf(engine_double.text, sizeof engine_double.text, "another capture is under way");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", NULL, NULL), 409, "another capture is under way");
    engine_double.code = LUMI_ERR_NOTFOUND;
    expect(fixture_ask(*state, "POST", "/api/v1/capture/retake", JSON_TYPE, "{\"capture\":\"a\"}"), 404,
           "urn:lumid:notfound");
}

static void every_wish_reaches_the_engine(void **state)
{
    static const char *const simple[][2] = {{"pause", "pause"}, {"resume", "resume"}, {"clear", "clear"}};

    for (int i = 0; i < 3; i++) {
        g_autofree char *path = g_strconcat("/api/v1/capture/", simple[i][0], NULL);
        expect(fixture_ask(*state, "POST", path, NULL, NULL), 202, NULL);
        assert_string_equal(engine_double.call, simple[i][1]);
        expect(fixture_ask(*state, "GET", path, NULL, NULL), 405, NULL);
    }
    expect(fixture_ask(*state, "POST", "/api/v1/capture/stop", NULL, NULL), 202, NULL);
    assert_true(engine_double.seal && !engine_double.at_once);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/stop", JSON_TYPE, "{\"at_once\":true,\"seal\":false}"), 202,
           NULL);
    assert_true(!engine_double.seal && engine_double.at_once);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/retake", JSON_TYPE, "{\"frames\":[\"a\",\"b\",\"c\"]}"), 202,
           NULL);
    assert_int_equal(engine_double.count, 3);
    expect(fixture_ask(*state, "POST", "/api/v1/processing", JSON_TYPE, "{\"capture\":\"/c\",\"again\":true}"), 202,
           NULL);
    assert_true(engine_double.again);
    assert_string_equal(engine_double.capture, "/c");
}

static void a_home_is_told_its_turn(void **state)
{
    static const char *const bad[] = {"{\"turn\":-1}",    "{\"turn\":10001}", "{\"turn\":1.5}",
                                      "{\"turn\":\"1\"}", "{\"turn\":true}",  "{\"wind_up\":1}"};

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        expect(fixture_ask(*state, "POST", "/api/v1/capture/home", JSON_TYPE, bad[i]), 422, NULL);
    assert_int_equal(engine_double.calls, 0);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/home", JSON_TYPE, "{\"turn\":7,\"wind_up\":true}"), 202, NULL);
    assert_string_equal(engine_double.call, "home");
    assert_true(engine_double.count == 7 && engine_double.seal);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/home", NULL, NULL), 202, NULL);
    assert_true(engine_double.count == 0 && !engine_double.seal);
}

static void what_is_not_known_is_null(void **state)
{
    struct lumi_engine_camera_status *camera = engine_double.status.cameras;
    static const char *const names[] = {
        "width",          "height",          "exposure_s",       "gain",
        "clock_offset_s", "clock_drift_ppm", "clock_residual_s", "clock_residual_worst_s"};

    for (int known = 0; known <= 1; known++) {
        camera->status.format.width = camera->status.format.height = 640 * known;
        camera->status.exposure_s = camera->status.gain = 2.0 * known;
        camera->clock_fitted = known;
        struct answer answer = fixture_ask(*state, "GET", "/api/v1/status", NULL, NULL);
        for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
            g_autofree char *text = g_strdup_printf("\"%s\":null", names[i]);
            if ((strstr(answer.body, text) == NULL) != known)
                fail_msg("%s, known %d: %s", names[i], known, answer.body);
        }
        expect(answer, 200, known ? "\"width\":640," : NULL);
    }
}

/* Captures may be taken in, with nothing to be started for them. */
static void processing_is_configured_where_there_is_a_command(void **state)
{
    struct fixture *fixture = *state;

    expect(fixture_ask(fixture, "GET", "/api/v1/processing", NULL, NULL), 200, "\"configured\":false");
    lumi_http_stop(fixture->http);
    fixture->options.processes = true;
    fixture_start(fixture);
    expect(fixture_ask(fixture, "GET", "/api/v1/processing", NULL, NULL), 200, "\"configured\":true");
}

/* What no main loop does for anybody while it does not come round; it is this thread's, which waits in poll instead. */
static struct answer ask_beside_the_loop(const struct fixture *fixture, const char *path, const char *head)
{
    int fd = fixture_connect(fixture);
    g_autofree char *text =
        g_strdup_printf("POST %s HTTP/1.1\r\nHost: localhost\r\n%sConnection: close\r\nContent-Length: 0\r\n\r\n", path,
                        head ? head : "");
    GString *got = g_string_new(NULL);
    char block[4096];

    fcntl(fd, F_SETFL, 0);
    assert_int_equal(send(fd, text, strlen(text), MSG_NOSIGNAL), strlen(text));
    for (ssize_t size; (size = recv(fd, block, sizeof block, 0)) > 0;)
        g_string_append_len(got, block, size);
    close(fd);
    return answer_of(got);
}

static void an_emergency_stop_waits_for_no_main_loop(void **state)
{
    static const char wish[] = "POST /api/v1/capture/pause HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n";
    int waiting = fixture_connect(*state);

    fixture_send(waiting, wish, strlen(wish)); /* another that waits for the loop does not hold it up either */
    expect(ask_beside_the_loop(*state, "/api/v1/capture/emergency-stop", NULL), 202, "{\"sent\":true}");
    assert_int_equal(fixture_stops, 1);
    assert_int_equal(engine_double.calls, 0);
    expect(ask_beside_the_loop(*state, "/api/v1/capture/emergency-stop", "Origin: https://evil.example\r\n"), 403,
           NULL);
    assert_int_equal(fixture_stops, 1);
    /* The engine is told when the loop comes round, and of the wish, in whatever order the two connections were read.
     */
    for (int turn = 0; engine_double.calls < 2 && turn < 4000; turn++)
        fixture_wait();
    assert_true(!strcmp(engine_double.call, "emergency stop") || !strcmp(engine_double.call, "pause"));
    assert_int_equal(engine_double.calls, 2);
    g_string_free(fixture_receive(waiting, "}"), TRUE);
    close(waiting);
    struct answer answer = fixture_ask(*state, "GET", "/api/v1/capture/emergency-stop", NULL, NULL);
    expect(answer, 405, NULL);
}

static void a_foreign_page_is_refused(void **state)
{
    static const char *const bad[] = {
        "Host: evil.example\r\n",
        "Host: localhost.evil.example\r\n",
        "Host: 127.0.0.1.evil.example\r\n",
        "Host: 192.168.1.7\r\n",
    };

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        expect(fixture_ask(*state, "GET", "/api/v1/status", bad[i], NULL), 421,
               "urn:lumid:host\",\"title\":\"Misdirected Request\"");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Origin: https://evil.example\r\n", NULL), 403,
           "urn:lumid:origin");
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Origin: null\r\n", NULL), 403, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Origin: https://localhost\r\n", NULL), 403, NULL);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Sec-Fetch-Site: cross-site\r\n", NULL), 403, NULL);
    assert_int_equal(engine_double.calls, 0);
    expect(fixture_ask(*state, "POST", "/api/v1/capture/pause", "Origin: http://localhost\r\n", NULL), 202, NULL);
    expect(fixture_ask(*state, "GET", "/api/v1/status", "Host: [::1]:8470\r\n", NULL), 200, NULL);
}

static void a_token_is_asked_of_all_but_this_computer(void **state)
{
    struct fixture *fixture = *state;

    /* Who has one for another lumid shows it here as well. */
    expect(fixture_ask(fixture, "GET", "/api/v1/status", "Authorization: Bearer other\r\n", NULL), 200, NULL);
    lumi_http_stop(fixture->http);
    fixture->options.token = "s3cret";
    fixture_start(fixture);
    expect(fixture_ask(fixture, "GET", "/api/v1/status", NULL, NULL), 200, NULL);
    expect(fixture_ask(fixture, "GET", "/api/v1/status", "Host: rig.local\r\n", NULL), 421, NULL);
    expect(fixture_ask(fixture, "GET", "/api/v1/status", "Authorization: Bearer wrong\r\n", NULL), 401, "is wrong");
    lumi_http_stop(fixture->http);
    fixture->options.token_everywhere = true;
    fixture_start(fixture);
    struct answer answer = fixture_ask(fixture, "GET", "/api/v1/status", NULL, NULL);
    assert_non_null(strstr(answer.head, "WWW-Authenticate: Bearer"));
    expect(answer, 401, "urn:lumid:token");
    expect(fixture_ask(fixture, "GET", "/metrics", NULL, NULL), 401, NULL);
    expect(fixture_ask(fixture, "GET", "/nothing", NULL, NULL), 401, NULL);
    expect(fixture_ask(fixture, "POST", "/api/v1/capture/pause", "Authorization: Bearer s3cre\r\n", NULL), 401, NULL);
    expect(fixture_ask(fixture, "POST", "/api/v1/capture/pause", "Authorization: Bearer s3cret2\r\n", NULL), 401, NULL);
    expect(fixture_ask(fixture, "POST", "/api/v1/capture/pause", "Authorization: Basic s3cret\r\n", NULL), 401, NULL);
    assert_int_equal(engine_double.calls, 0);
    expect(fixture_ask(fixture, "POST", "/api/v1/capture/pause", "Authorization: bearer  s3cret\r\n", NULL), 202, NULL);
    expect(fixture_ask(fixture, "GET", "/api/v1/status", "Host: rig.local\r\nAuthorization: Bearer s3cret\r\n", NULL),
           200, NULL);
}

static void others_reach_it_only_with_a_token(void **state)
{
    struct fixture *fixture = *state;
    struct lumi_http *second = NULL;
    struct lumi_error error;
    g_autofree char *taken = g_strdup_printf("127.0.0.1:%d", lumi_http_port(fixture->http));

    fixture->options.listen = "0.0.0.0:0";
    assert_int_equal(lumi_http_start(&fixture->options, &second, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "token"));
    fixture->options.listen = "*:0";
    assert_int_equal(lumi_http_start(&fixture->options, &second, &error), LUMI_ERR_ARG);
    fixture->options.listen = taken;
    assert_int_equal(lumi_http_start(&fixture->options, &second, &error), LUMI_ERR_BUSY);
    fixture->options.listen = "rig.local:80";
    assert_int_equal(lumi_http_start(&fixture->options, &second, &error), LUMI_ERR_ARG);
    fixture->options.listen = "0.0.0.0:0";
    fixture->options.token = "t";
    assert_int_equal(lumi_http_start(&fixture->options, &second, &error), LUMI_OK);
    lumi_http_stop(second);
}

static long resident_kib(void)
{
    char line[128];
    long kib = 0;
    FILE *file = fopen("/proc/self/status", "r");

    while (fgets(line, sizeof line, file))
        if (sscanf(line, "VmRSS: %ld", &kib) == 1)
            break;
    fclose(file);
    return kib;
}

static void a_gigabyte_is_refused_before_it_is_read(void **state)
{
    static const char head[] = "POST /api/v1/capture/start HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
                               "application/json\r\nContent-Length: 1073741824\r\n\r\n";
    int fd = fixture_connect(*state);
    g_autofree char *block = g_strnfill(1 << 20, ' ');
    long before = resident_kib();

    fixture_send(fd, head, strlen(head));
    for (int i = 0; i < 8; i++) /* the rest is on its way */
        fixture_send(fd, block, 1 << 20);
    expect(answer_of(fixture_receive(fd, "}")), 413, "1073741824 bytes; 1048576 are the most");
    assert_true(resident_kib() - before < 4096);
    close(fd);
    turn_the_loop();
    static const char chunked[] = "POST /api/v1/capture/start HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: "
                                  "chunked\r\n\r\n5\r\nabcde\r\n";
    fd = fixture_connect(*state);
    fixture_send(fd, chunked, strlen(chunked));
    expect(answer_of(fixture_receive(fd, "}")), 411, "urn:lumid:length");
    close(fd);
    static const char polite[] = "POST /api/v1/capture/start HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\n"
                                 "Content-Length: 1073741824\r\n\r\n";
    fd = fixture_connect(*state);
    fixture_send(fd, polite, strlen(polite));
    expect(answer_of(fixture_receive(fd, "}")), 413, NULL);
    close(fd);
    expect(fixture_ask(*state, "GET", "/api/v1/capture", NULL, NULL), 200, NULL);
    assert_int_equal(engine_double.calls, 0);
}

static int two_cameras(void *context, struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    (void)context;
    (void)error;
    assert_true(max >= 2);
    snprintf(cameras[0].serial, sizeof cameras[0].serial, "one");
    snprintf(cameras[1].serial, sizeof cameras[1].serial, "two");
    return 2;
}

static void devices_are_looked_for_beside_the_loop(void **state)
{
    struct fixture *fixture = *state;

    lumi_http_stop(fixture->http);
    fixture->options.devices = two_cameras;
    fixture_start(fixture);
    expect(fixture_ask(fixture, "GET", "/api/v1/devices", NULL, NULL), 200, "\"serial\":\"two\"");
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, fixture_set_up, fixture_tear_down)
    const struct CMUnitTest tests[] = {
        CASE(status_is_one_object),
        CASE(what_is_not_there_is_a_problem_document),
        CASE(a_start_reaches_the_engine),
        CASE(a_body_that_is_wrong_changes_nothing),
        CASE(what_the_engine_refuses_is_said_in_its_words),
        CASE(every_wish_reaches_the_engine),
        CASE(a_home_is_told_its_turn),
        CASE(what_is_not_known_is_null),
        CASE(processing_is_configured_where_there_is_a_command),
        CASE(an_emergency_stop_waits_for_no_main_loop),
        CASE(a_foreign_page_is_refused),
        CASE(a_token_is_asked_of_all_but_this_computer),
        CASE(others_reach_it_only_with_a_token),
        CASE(a_gigabyte_is_refused_before_it_is_read),
        CASE(devices_are_looked_for_beside_the_loop),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
