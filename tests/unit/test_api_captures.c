/* Captures over the API: what is listed, small pictures, verifying, one file of many, throwing away; and names that
 * lead elsewhere. */
#include "tests/unit/api_fixture.h"
#include "tests/unit/capture_fixture.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <sys/file.h>
#include <sys/stat.h>

#define NAME "place.capture"
static char folder[PATH_SIZE], copies[PATH_SIZE];

static void store_picture(struct lumi_capture *capture, int64_t camera, const char *name, int seed)
{
    struct lumi_image_options options;
    struct lumi_raster raster;
    struct lumi_capture_file file = small_file();
    uint8_t *data = NULL;
    size_t size;

    OK(lumi_raster_create(&raster, 16, 12, 3, LUMI_U8));
    for (int y = 0; y < 12; y++)
        for (int x = 0; x < 48; x++)
            lumi_row_u8(&raster, y)[x] = (uint8_t)(x * 5 + y * seed);
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    OK(lumi_image_encode(&raster, &options, &data, &size, error));
    OK(lumi_capture_store_bytes(capture, add_frame(capture, camera, name), data, size, &file, error));
    lumi_free(data);
    lumi_raster_finish(&raster);
}

static void make_capture(const char *where, const char *name, bool sealed)
{
    struct lumi_capture *capture;
    char path[2 * PATH_SIZE];

    snprintf(path, sizeof path, "%s/%s", where, name);
    OK(lumi_capture_create_live(path, &capture, error));
    OK(lumi_capture_set_meta(capture, "title", "The hall", error));
    int64_t camera = add_camera(capture, "c00");
    for (int i = 0; i < 3; i++) {
        char frame[32];
        snprintf(frame, sizeof frame, "c00-%d", i);
        store_picture(capture, camera, frame, i);
    }
    if (sealed)
        OK(lumi_capture_seal(capture, "2026-05-02", error));
    lumi_capture_close(capture);
}

static int set_up(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);

    snprintf(folder, sizeof folder, "/tmp/lumi-shelf-XXXXXX");
    snprintf(copies, sizeof copies, "/tmp/lumi-copies-XXXXXX");
    assert_non_null(mkdtemp(folder));
    assert_non_null(mkdtemp(copies));
    make_capture(folder, NAME, true);
    fixture_time = 1;
    fixture_options(fixture);
    fixture->options.folder = folder;
    fixture->options.second_copy = copies;
    fixture_start(fixture);
    *state = fixture;
    return 0;
}

static int tear_down(void **state)
{
    fixture_tear_down(state);
    shell("rm -rf '%s' '%s'", folder, copies);
    return 0;
}

static void start_again(struct fixture *fixture)
{
    lumi_http_stop(fixture->http);
    turn_the_loop();
    fixture_start(fixture);
}

static void assert_answer(struct fixture *fixture, const char *method, const char *path, const char *body, int status,
                          const char *part)
{
    struct answer answer = fixture_ask(fixture, method, path, body ? JSON_TYPE : NULL, body);

    if (answer.status != status || !strstr(answer.body, part))
        fail_msg("%s %s: %d %s", path, body ? body : "", answer.status, answer.body);
    answer_clear(&answer);
}

/* The capture's entry of the list. */
static JsonObject *listed(struct fixture *fixture, JsonParser *parser, const char *name)
{
    struct answer answer = fixture_ask(fixture, "GET", "/api/v1/captures", NULL, NULL);
    JsonObject *found = NULL;

    assert_int_equal(answer.status, 200);
    assert_true(json_parser_load_from_data(parser, answer.body, -1, NULL));
    JsonArray *captures = json_object_get_array_member(json_node_get_object(json_parser_get_root(parser)), "captures");
    for (guint i = 0; i < json_array_get_length(captures); i++) {
        JsonObject *one = json_array_get_object_element(captures, i);
        if (!strcmp(json_object_get_string_member(one, "name"), name))
            found = one;
    }
    answer_clear(&answer);
    return found;
}

static void seal_of(const char *where, const char *name, char seal[65])
{
    char path[2 * PATH_SIZE];

    snprintf(path, sizeof path, "%s/%s", where, name);
    OK(lumi_capture_seal_of(path, seal, error));
}

static bool is_there(const char *name)
{
    char path[2 * PATH_SIZE];
    struct stat is;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return !lstat(path, &is);
}

static void wait_until_gone(const char *name)
{
    for (int i = 0; i < 2000 && is_there(name); i++)
        fixture_wait();
    assert_false(is_there(name));
}

static void the_list_says_seal_and_picture_and_nothing_that_is_no_capture(void **state)
{
    g_autoptr(JsonParser) parser = json_parser_new();
    char seal[65];

    seal_of(folder, NAME, seal);
    make_capture(folder, "arriving.capture", true);
    shell("mv '%s/arriving.capture' '%s/arriving.capture.partial'; ln -s '%s' '%s/link.capture'", folder, folder, "/",
          folder);
    JsonObject *one = listed(*state, parser, NAME);
    assert_non_null(one);
    assert_string_equal(json_object_get_string_member(one, "seal"), seal);
    assert_int_equal(strlen(seal), 64);
    assert_true(json_object_get_boolean_member(one, "thumbnail"));
    assert_true(json_object_get_null_member(one, "verified"));
    assert_null(listed(*state, parser, "arriving.capture.partial"));
    assert_null(listed(*state, parser, "link.capture"));
}

static void names_that_lead_elsewhere_are_no_captures(void **state)
{
    static const char *const names[] = {"..", "../x", "a/b", ".lumid", "", "/etc", "link.capture", "x.partial", "none"};
    static const char *const paths[] = {"%2e%2e", "..%2fx", "link.capture", ".lumid", "x.partial", "none"};

    shell("mkdir -p '%s/elsewhere'; mv '%s/" NAME "' '%s/elsewhere/'; ln -s '%s/elsewhere/" NAME
          "' '%s/link.capture'; cp -r '%s/elsewhere/" NAME "' '%s/x.partial'",
          copies, folder, copies, copies, folder, copies, folder);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        g_autofree char *body = g_strdup_printf("{\"capture\":\"%s\"}", names[i]);
        g_autofree char *word = g_strdup_printf("{\"capture\":\"%s\",\"word\":\"%s\"}", names[i], names[i]);
        assert_answer(*state, "POST", "/api/v1/captures/verify", body, 404, "notfound");
        assert_answer(*state, "POST", "/api/v1/captures/delete", word, 404, "notfound");
    }
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        g_autofree char *bundle = g_strdup_printf("/api/v1/captures/%s/bundle.tar", paths[i]);
        g_autofree char *picture = g_strdup_printf("/api/v1/captures/%s/thumbnail.jpg", paths[i]);
        assert_answer(*state, "GET", bundle, NULL, 404, "urn:lumid:");
        assert_answer(*state, "GET", picture, NULL, 404, "urn:lumid:");
    }
    assert_true(is_there("x.partial"));
}

static void a_small_picture_is_made_once_and_beside_the_capture(void **state)
{
    struct answer answer;
    struct stat first, second;
    char file[2 * PATH_SIZE];

    snprintf(file, sizeof file, "%s/.lumid/thumbnails/" NAME ".jpg", folder);
    answer = fixture_ask(*state, "GET", "/api/v1/captures/" NAME "/thumbnail.jpg", NULL, NULL);
    assert_int_equal(answer.status, 200);
    assert_non_null(strstr(answer.head, "Content-Type: image/jpeg"));
    assert_memory_equal(answer.body, "\xff\xd8\xff", 3);
    answer_clear(&answer);
    assert_int_equal(stat(file, &first), 0);
    assert_answer(*state, "GET", "/api/v1/captures/" NAME "/thumbnail.jpg", NULL, 200, "");
    assert_int_equal(stat(file, &second), 0);
    assert_true(first.st_ino == second.st_ino);
    g_autofree char *path = g_strdup_printf("%s/" NAME, folder);
    assert_int_equal(problems_of(path), 0); /* the bag is as it was */
}

/* ---- verifying ---- */

static char *follow_verify(struct fixture *fixture, const char *until)
{
    static const char request[] = "GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
    int fd = fixture_connect(fixture);

    fixture_send(fd, request, strlen(request));
    GString *got = fixture_receive(fd, until);
    close(fd);
    return g_string_free(got, FALSE);
}

static void a_capture_is_verified_and_the_result_outlives_the_program(void **state)
{
    g_autoptr(JsonParser) parser = json_parser_new();

    assert_answer(*state, "POST", "/api/v1/captures/verify", "{\"capture\":\"" NAME "\"}", 202, "\"running\"");
    g_free(follow_verify(*state, "\"state\":\"good\""));
    start_again(*state);
    JsonObject *verified = json_object_get_object_member(listed(*state, parser, NAME), "verified");
    assert_non_null(verified);
    assert_true(json_object_get_boolean_member(verified, "good"));
    assert_non_null(strstr(json_object_get_string_member(verified, "text"), "whole, sealed"));
    /* Of a capture that is another by now it says nothing. */
    shell("rm -rf '%s/" NAME "'", folder);
    make_capture(folder, NAME, false);
    assert_true(json_object_get_null_member(listed(*state, parser, NAME), "verified"));
}

static void what_is_damaged_is_named(void **state)
{
    g_autoptr(JsonParser) parser = json_parser_new();

    shell("printf x >>'%s/" NAME "/data/frames/c00-1.jpg'", folder);
    assert_answer(*state, "POST", "/api/v1/captures/verify", "{\"capture\":\"" NAME "\"}", 202, "");
    g_autofree char *told = follow_verify(*state, "\"state\":\"bad\"");
    (void)told;
    JsonObject *verified = json_object_get_object_member(listed(*state, parser, NAME), "verified");
    assert_false(json_object_get_boolean_member(verified, "good"));
    assert_non_null(strstr(json_object_get_string_member(verified, "text"), "c00-1.jpg"));
}

static void what_is_under_way_is_neither_verified_nor_deleted(void **state)
{
    snprintf(engine_double.status.capture, sizeof engine_double.status.capture, "%s/" NAME, folder);
    engine_double.status.state = LUMI_ENGINE_SWEEPING;
    assert_answer(*state, "POST", "/api/v1/captures/verify", "{\"capture\":\"" NAME "\"}", 409, "under way (sweeping)");
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 409,
                  "under way (sweeping)");
    engine_double.status.state = LUMI_ENGINE_DONE;
    engine_double.processing_count = 1;
    snprintf(engine_double.processing[0].capture, sizeof engine_double.processing[0].capture, "%s/" NAME, folder);
    engine_double.processing[0].state = LUMI_PROCESS_RUNNING;
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 409,
                  "processed");
    engine_double.processing_count = 0;
    engine_double.ingest_count = 1;
    snprintf(engine_double.ingest[0].capture, sizeof engine_double.ingest[0].capture, "%s/" NAME, folder);
    engine_double.ingest[0].state = LUMI_INGEST_VERIFYING;
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 409,
                  "taken in");
    assert_true(is_there(NAME));
}

/* ---- throwing away ---- */

static void deleting_wants_a_word_or_a_seal_that_is_right(void **state)
{
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\"}", 422, "'seal'");
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"yes\"}", 422,
                  "not the name");
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"seal\":\"0123\"}", 422,
                  "urn:lumid:checksum");
    assert_true(is_there(NAME));
    char seal[65];
    seal_of(folder, NAME, seal);
    g_autofree char *body = g_strdup_printf("{\"capture\":\"" NAME "\",\"seal\":\"%s\"}", seal);
    assert_answer(*state, "POST", "/api/v1/captures/delete", body, 202, NAME);
    assert_false(is_there(NAME));
    wait_until_gone(".deleted-" NAME);
    assert_answer(*state, "POST", "/api/v1/captures/delete", body, 404, "notfound");
}

static void who_writes_a_capture_keeps_it(void **state)
{
    g_autofree char *path = g_strdup_printf("%s/" NAME, folder);
    int fd = open(path, O_RDONLY | O_CLOEXEC);

    assert_int_equal(flock(fd, LOCK_EX | LOCK_NB), 0);
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 409,
                  "being written");
    close(fd);
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 202,
                  NAME);
    assert_false(is_there(NAME));
}

static void a_second_copy_that_is_whole_is_enough(void **state)
{
    static const char body[] = "{\"capture\":\"" NAME "\",\"copy\":true}";

    assert_answer(*state, "POST", "/api/v1/captures/delete", body, 404, "notfound");
    shell("cp -r '%s/" NAME "' '%s/'; cp '%s/" NAME "/data/frames/c00-1.jpg' '%s/kept'; printf x >>'%s/" NAME
          "/data/frames/c00-1.jpg'",
          folder, copies, folder, copies, copies);
    assert_answer(*state, "POST", "/api/v1/captures/delete", body, 422, "c00-1.jpg");
    assert_true(is_there(NAME));
    shell("cp '%s/kept' '%s/" NAME "/data/frames/c00-1.jpg'", copies, copies);
    assert_answer(*state, "POST", "/api/v1/captures/delete", body, 202, NAME);
    assert_false(is_there(NAME));
    g_autofree char *copy = g_strdup_printf("%s/" NAME, copies);
    assert_int_equal(problems_of(copy), 0);
}

static void what_was_being_removed_is_removed_by_the_next_start(void **state)
{
    lumi_http_stop(((struct fixture *)*state)->http);
    turn_the_loop();
    shell("mv '%s/" NAME "' '%s/.deleted-" NAME "'; mkdir '%s/.deleted-again'", folder, folder, folder);
    fixture_start(*state);
    wait_until_gone(".deleted-" NAME);
    wait_until_gone(".deleted-again");
}

/* ---- as one file ---- */

static GString *fetch(struct fixture *fixture, const char *head, int *status, char **headers)
{
    int fd = fixture_connect(fixture);
    g_autofree char *request = g_strdup_printf("GET /api/v1/captures/" NAME "/bundle.tar HTTP/1.1\r\nHost: "
                                               "localhost\r\nConnection: close\r\n%s\r\n",
                                               head);

    fixture_send(fd, request, strlen(request));
    GString *got = fixture_receive(fd, NULL);
    close(fd);
    char *end = g_strstr_len(got->str, (gssize)got->len, "\r\n\r\n");
    assert_non_null(end);
    assert_int_equal(sscanf(got->str, "HTTP/1.1 %d", status), 1);
    if (headers)
        *headers = g_strndup(got->str, (gsize)(end + 2 - got->str));
    return g_string_erase(got, 0, end + 4 - got->str);
}

static void a_bundle_is_the_capture_and_its_length_is_promised(void **state)
{
    g_autofree char *headers = NULL;
    char path[2 * PATH_SIZE], seal[65];
    int status;

    /* Longer than a piece, and than a block. */
    shell("rm -rf '%s/" NAME "'", folder);
    make_capture(folder, NAME, false);
    struct lumi_capture *capture;
    snprintf(path, sizeof path, "%s/" NAME, folder);
    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_capture_seal(capture, NULL, error));
    lumi_capture_close(capture);
    seal_of(folder, NAME, seal);
    g_autoptr(GString) tar = fetch(*state, "", &status, &headers);
    assert_int_equal(status, 200);
    g_autofree char *length = g_strdup_printf("Content-Length: %zu\r\n", tar->len);
    assert_non_null(strstr(headers, length));
    g_autofree char *tag = g_strdup_printf("ETag: \"%s\"\r\n", seal);
    assert_non_null(strstr(headers, tag));
    assert_non_null(strstr(headers, "Accept-Ranges: bytes"));
    snprintf(path, sizeof path, "%s/bundle.tar", copies);
    assert_true(g_file_set_contents(path, tar->str, (gssize)tar->len, NULL));
    shell("cd '%s' && tar xf bundle.tar && diff -r " NAME " '%s/" NAME "'", copies, folder);
    snprintf(path, sizeof path, "%s/" NAME, copies);
    assert_int_equal(problems_of(path), 0);
}

static void a_bundle_goes_on_where_it_broke_off(void **state)
{
    g_autofree char *headers = NULL;
    int status;
    char seal[65];
    g_autoptr(GString) whole = fetch(*state, "", &status, NULL), again = fetch(*state, "", &status, NULL);

    seal_of(folder, NAME, seal);
    assert_int_equal(whole->len, again->len);
    assert_memory_equal(whole->str, again->str, whole->len);
    g_autofree char *range = g_strdup_printf("Range: bytes=1000-\r\nIf-Range: \"%s\"\r\n", seal);
    g_autoptr(GString) rest = fetch(*state, range, &status, &headers);
    assert_int_equal(status, 206);
    g_autofree char *told = g_strdup_printf("Content-Range: bytes 1000-%zu/%zu\r\n", whole->len - 1, whole->len);
    assert_non_null(strstr(headers, told));
    assert_int_equal(rest->len, whole->len - 1000);
    assert_memory_equal(rest->str, whole->str + 1000, rest->len);
    g_autoptr(GString) middle = fetch(*state, "Range: bytes=511-1536\r\n", &status, NULL);
    assert_int_equal(status, 206);
    assert_int_equal(middle->len, 1026);
    assert_memory_equal(middle->str, whole->str + 511, 1026);
    g_autoptr(GString) other = fetch(*state, "Range: bytes=1000-\r\nIf-Range: \"another\"\r\n", &status, NULL);
    assert_int_equal(status, 200); /* another capture by now: from the beginning */
    assert_int_equal(other->len, whole->len);
    g_autoptr(GString) beyond = fetch(*state, "Range: bytes=99999999-\r\n", &status, NULL);
    assert_int_equal(status, 416);
}

static void what_is_open_is_not_carried_away(void **state)
{
    make_capture(folder, "open.capture", false);
    assert_answer(*state, "GET", "/api/v1/captures/open.capture/bundle.tar", NULL, 409, "not sealed");
}

/* Ten captures' worth in the file system's cache of a client that reads nothing. */
static void who_does_not_read_holds_nobody_up_and_keeps_the_capture(void **state)
{
    static const char request[] = "GET /api/v1/captures/" NAME "/bundle.tar HTTP/1.1\r\nHost: localhost\r\n\r\n";
    struct lumi_capture *capture;
    char path[2 * PATH_SIZE];
    int fd;

    snprintf(path, sizeof path, "%s/" NAME, folder);
    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_capture_set_meta(capture, "title", "large", error));
    g_autofree char *large = g_malloc0(8 << 20);
    struct lumi_capture_file file = small_file();
    OK(lumi_capture_store_bytes(capture, add_frame(capture, 1, "c00-9"), large, 8 << 20, &file, error));
    OK(lumi_capture_seal(capture, NULL, error));
    lumi_capture_close(capture);
    fd = fixture_connect(*state);
    fixture_send(fd, request, strlen(request));
    for (int i = 0; i < 200; i++) {
        char byte;
        if (recv(fd, &byte, 1, MSG_PEEK) == 1)
            break;
        fixture_wait();
    }
    assert_answer(*state, "GET", "/api/v1/captures", NULL, 200, NAME);
    assert_answer(*state, "POST", "/api/v1/captures/delete", "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}", 409,
                  "downloaded");
    fixture_time = 100 * 1000000000LL; /* a minute and more: hung up on */
    for (int i = 0; i < 4000; i++) {
        struct answer answer = fixture_ask(*state, "POST", "/api/v1/captures/delete", JSON_TYPE,
                                           "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}");
        int status = answer.status;
        answer_clear(&answer);
        if (status == 202)
            break;
        assert_int_equal(status, 409);
        fixture_time += 1000000000LL; /* what was written was, perhaps, just now */
        fixture_wait();
    }
    for (int i = 0; i < 4000 && is_there(NAME); i++)
        fixture_wait();
    assert_false(is_there(NAME));
    close(fd);
}

/* Under the reader's hands: nothing but the end of the connection can tell, and nobody has the capture then. */
static void what_is_cut_short_while_it_is_carried_away_breaks_off(void **state)
{
    static const char request[] = "GET /api/v1/captures/" NAME "/bundle.tar HTTP/1.1\r\nHost: localhost\r\n\r\n";
    struct lumi_capture *capture;
    char path[2 * PATH_SIZE];

    snprintf(path, sizeof path, "%s/" NAME, folder);
    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_capture_set_meta(capture, "title", "large", error));
    g_autofree char *large = g_malloc0(32 << 20);
    struct lumi_capture_file file = small_file();
    OK(lumi_capture_store_bytes(capture, add_frame(capture, 1, "c00-9"), large, 32 << 20, &file, error));
    OK(lumi_capture_seal(capture, NULL, error));
    lumi_capture_close(capture);
    int fd = fixture_connect(*state);
    fixture_send(fd, request, strlen(request));
    for (int i = 0; i < 2000; i++) {
        char byte;
        if (recv(fd, &byte, 1, MSG_PEEK) == 1)
            break;
        fixture_wait();
    }
    shell("find '%s/" NAME "/data' -size +16M -exec truncate -s 1000 {} +", folder);
    g_string_free(fixture_receive(fd, NULL), TRUE); /* ends */
    close(fd);
    int status = 0;
    for (int i = 0; i < 2000 && status != 202; i++) {
        struct answer answer = fixture_ask(*state, "POST", "/api/v1/captures/delete", JSON_TYPE,
                                           "{\"capture\":\"" NAME "\",\"word\":\"" NAME "\"}");
        status = answer.status;
        answer_clear(&answer);
        fixture_wait();
    }
    assert_int_equal(status, 202);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(the_list_says_seal_and_picture_and_nothing_that_is_no_capture),
        CASE(names_that_lead_elsewhere_are_no_captures),
        CASE(a_small_picture_is_made_once_and_beside_the_capture),
        CASE(a_capture_is_verified_and_the_result_outlives_the_program),
        CASE(what_is_damaged_is_named),
        CASE(what_is_under_way_is_neither_verified_nor_deleted),
        CASE(deleting_wants_a_word_or_a_seal_that_is_right),
        CASE(who_writes_a_capture_keeps_it),
        CASE(a_second_copy_that_is_whole_is_enough),
        CASE(what_was_being_removed_is_removed_by_the_next_start),
        CASE(a_bundle_is_the_capture_and_its_length_is_promised),
        CASE(a_bundle_goes_on_where_it_broke_off),
        CASE(what_is_open_is_not_carried_away),
        CASE(who_does_not_read_holds_nobody_up_and_keeps_the_capture),
        CASE(what_is_cut_short_while_it_is_carried_away_breaks_off),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
