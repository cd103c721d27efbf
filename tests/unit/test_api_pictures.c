/* daemon/http: the cameras' pictures over the API: figures, files, live streams, who is slow, who is told. */
#include "tests/unit/api_fixture.h"
#include "tests/unit/preview_frame.h"

#define SECOND 1000000000LL
#define SIDE 640

static atomic_int out;
static struct lumi_pictures *pictures;
static int shot;

static int begin(void **state)
{
    struct fixture *fixture = calloc(1, sizeof *fixture);
    struct lumi_pictures_options options;
    struct lumi_error error;

    lumi_pictures_options_init(&options);
    options.cameras = 1;
    options.synchronous = true;
    g_strlcpy(options.names[0], "c00", sizeof options.names[0]);
    assert_int_equal(lumi_pictures_create(&options, &pictures, &error), LUMI_OK);
    fixture_time = SECOND;
    shot = 0;
    fixture_options(fixture);
    fixture->options.pictures = pictures;
    fixture_start(fixture);
    *state = fixture;
    return 0;
}

static int end(void **state)
{
    fixture_tear_down(state);
    lumi_pictures_destroy(pictures);
    assert_int_equal(out, 0);
    return 0;
}

/* The next picture of c00: noise, so that it is large. Two seconds go by. */
static void take(void)
{
    struct preview_frame *frame = preview_frame_new(LUMI_LAYOUT_RGB, SIDE, SIDE, 8, 0, &out);
    const struct lumi_picture_offer offer = {
        .frame = &frame->frame, .name = "c00-t00-p000", .shot = shot++, .unix_us = 1000000, .spare = true};
    uint32_t noise = 12345;

    for (size_t i = 0; i < frame->frame.size; i++) {
        noise = noise * 1664525 + 1013904223;
        frame->bytes[i] = (uint8_t)(noise >> 24);
    }
    fixture_time += 2 * SECOND;
    assert_true(lumi_pictures_offer(pictures, fixture_time, &offer));
    lumi_camera_frame_release(&frame->frame);
    lumi_pictures_work(pictures, true);
}

static int ask(struct fixture *fixture, const char *path)
{
    int fd = fixture_connect(fixture);
    g_autofree char *request = g_strdup_printf("GET %s HTTP/1.1\r\nHost: localhost\r\n\r\n", path);

    fixture_send(fd, request, strlen(request));
    return fd;
}

/* Until it has so many of what is counted; what comes is no text. */
static void read_until(int fd, GString *got, int (*count)(const GString *got), int wanted)
{
    for (int idle = 0; count(got) < wanted && idle < 4000; idle++) {
        char block[65536];
        ssize_t size = recv(fd, block, sizeof block, 0);
        if (size > 0) {
            g_string_append_len(got, block, size);
            idle = 0;
        } else {
            fixture_wait();
        }
    }
    assert_true(count(got) >= wanted);
}

/* Parts that have come whole: each ends with a boundary. */
static int parts_of(const GString *got)
{
    int found = 0;

    for (gsize i = 0; i + 17 < got->len; i++)
        found += memcmp(got->str + i, "\r\n--lumid-picture", 17) == 0;
    return found;
}

static int is_whole(const GString *got)
{
    const char *length = strstr(got->str, "Content-Length: "), *end = strstr(got->str, "\r\n\r\n");

    return length && end && got->len == (gsize)(end + 4 - got->str) + (gsize)atol(length + 16);
}

static void figures_are_told_of_the_last_picture(void **state)
{
    struct answer answer = fixture_ask(*state, "GET", "/api/v1/cameras", NULL, NULL);

    assert_string_equal(answer.body,
                        "{\"cameras\":[{\"name\":\"c00\",\"there\":true,\"live\":true,\"text\":\"\",\"last\":null}]}");
    answer_clear(&answer);
    take();
    lumi_pictures_sharpness(pictures, 0, 0, 0.5);
    answer = fixture_ask(*state, "GET", "/api/v1/cameras", NULL, NULL);
    assert_non_null(strstr(answer.body, "\"frame\":\"c00-t00-p000\",\"shot\":0,\"time\":\"1970-01-01T00:00:01.000Z\","
                                        "\"number\":1,\"width\":640,\"height\":640,\"sharpness\":0.5,\"mean\":0."));
    answer_clear(&answer);
    engine_double.status.cameras[0].identity.records_itself = true;
    answer = fixture_ask(*state, "GET", "/api/v1/cameras", NULL, NULL);
    assert_non_null(strstr(answer.body, "\"live\":false,\"text\":\"it records by itself\""));
    answer_clear(&answer);
}

static void the_last_picture_is_a_file(void **state)
{
    static const char *const none[] = {"/api/v1/cameras/c00/last.jpg", "/api/v1/cameras/c01/last.jpg",
                                       "/api/v1/cameras/c01/live", "/api/v1/cameras/../last.jpg"};
    struct lumi_picture *picture;
    GString *got;
    int fd;

    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++) {
        struct answer answer = fixture_ask(*state, "GET", none[i], NULL, NULL);
        assert_int_equal(answer.status, 404);
        answer_clear(&answer);
    }
    take();
    picture = lumi_pictures_last(pictures, 0);
    fd = ask(*state, "/api/v1/cameras/c00/last.jpg");
    got = g_string_new(NULL);
    read_until(fd, got, is_whole, 1);
    assert_non_null(strstr(got->str, "200 OK"));
    assert_non_null(strstr(got->str, "Content-Type: image/jpeg"));
    assert_non_null(strstr(got->str, "X-Lumid-Picture: 1"));
    assert_memory_equal(got->str + got->len - picture->size, picture->jpeg, picture->size);
    g_string_free(got, TRUE);
    lumi_picture_release(picture);
    close(fd);
}

static void who_watches_gets_every_picture_as_it_comes(void **state)
{
    g_autoptr(GString) got = g_string_new(NULL);
    int fd;

    take();
    fd = ask(*state, "/api/v1/cameras/c00/live");
    read_until(fd, got, parts_of, 1); /* the last there is at once */
    assert_non_null(strstr(got->str, "Content-Type: multipart/x-mixed-replace; boundary=lumid-picture"));
    assert_int_equal(lumi_pictures_watchers(pictures, 0), 1);
    for (int i = 2; i < 6; i++) {
        take();
        read_until(fd, got, parts_of, i);
    }
    assert_int_equal(parts_of(got), 5);
    close(fd);
    for (int idle = 0; lumi_pictures_watchers(pictures, 0) > 0 && idle < 4000; idle++)
        fixture_wait();
    assert_int_equal(lumi_pictures_watchers(pictures, 0), 0);
}

/* Forty pictures of some 200 kB are more than the sockets between hold: of those that it did not take only the newest
 * is left. */
static void who_is_slow_misses_pictures_and_gets_the_newest(void **state)
{
    g_autoptr(GString) got = g_string_new(NULL);
    int fd = ask(*state, "/api/v1/cameras/c00/live");
    int before;

    take();
    read_until(fd, got, parts_of, 1);
    for (int i = 0; i < 40; i++) {
        take();
        fixture_settle(*state);
    }
    g_string_set_size(got, 0);
    for (before = -1; before != parts_of(got);) { /* until nothing more comes */
        before = parts_of(got);
        for (int i = 0; i < 40; i++) {
            char block[65536];
            ssize_t size;
            while ((size = recv(fd, block, sizeof block, 0)) > 0)
                g_string_append_len(got, block, size);
            fixture_wait();
        }
    }
    assert_in_range(before, 1, 38);
    /* The newest was not forgotten: nothing new comes, and still it was sent. */
    struct lumi_picture *picture = lumi_pictures_last(pictures, 0);
    bool found = false;
    for (gsize i = 0; i + 1000 < got->len && !found; i++)
        found = memcmp(got->str + i, picture->jpeg + picture->size - 1000, 1000) == 0;
    assert_true(found);
    lumi_picture_release(picture);
    close(fd);
}

static void listeners_are_told_once_a_second_and_who_comes_later_of_the_newest(void **state)
{
    int fd = ask(*state, "/api/v1/events");
    GString *got = fixture_receive(fd, "retry");

    g_string_free(got, TRUE);
    take();
    got = fixture_receive(fd, "\"number\":1,");
    assert_non_null(strstr(got->str, "event: picture\ndata: {\"camera\":\"c00\","));
    assert_null(strstr(got->str, "id: 0\nevent: picture"));
    g_string_free(got, TRUE);
    /* What the judge says is told when a second has gone by. */
    lumi_pictures_sharpness(pictures, 0, 0, 0.25);
    lumi_pictures_work(pictures, true);
    fixture_settle(*state);
    fixture_time += SECOND;
    got = fixture_receive(fd, "\"sharpness\":0.25");
    g_string_free(got, TRUE);
    close(fd);
    fd = ask(*state, "/api/v1/events");
    got = fixture_receive(fd, "\"sharpness\":0.25");
    g_string_free(got, TRUE);
    close(fd);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(figures_are_told_of_the_last_picture, begin, end),
        cmocka_unit_test_setup_teardown(the_last_picture_is_a_file, begin, end),
        cmocka_unit_test_setup_teardown(who_watches_gets_every_picture_as_it_comes, begin, end),
        cmocka_unit_test_setup_teardown(who_is_slow_misses_pictures_and_gets_the_newest, begin, end),
        cmocka_unit_test_setup_teardown(listeners_are_told_once_a_second_and_who_comes_later_of_the_newest, begin, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
