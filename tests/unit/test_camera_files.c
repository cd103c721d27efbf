/* Cameras that record by themselves: their files become frames, whole, once and in order. */
#define _XOPEN_SOURCE 700
#include "daemon/camera/camera_files_priv.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/image/image_head.h"

#include <ftw.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#define SECOND INT64_C(1000000000)

static char folder[64];

static int make_folder(void **state)
{
    (void)state;
    snprintf(folder, sizeof folder, "/tmp/lumi-files-XXXXXX");
    assert_non_null(mkdtemp(folder));
    files_memory_forget_all();
    return 0;
}

static int remove_one(const char *path, const struct stat *status, int flag, struct FTW *ftw)
{
    (void)status;
    (void)flag;
    (void)ftw;
    return remove(path);
}

static int remove_folder(void **state)
{
    (void)state;
    nftw(folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
    files_memory_forget_all();
    return 0;
}

static void put(const char *name, const void *data, size_t size)
{
    char path[256];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

static void put_jpeg(const char *name)
{
    static const uint8_t jpeg[] = {0xff, 0xd8, 0xff, 0xe0, 0, 2, 0xff, 0xd9, 0, 0, 0};

    put(name, jpeg, sizeof jpeg);
}

static void watch_folder(struct files_watch *watch)
{
    struct lumi_error error = {0};

    if (files_watch_init(watch, folder, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

/* Everything that comes now, as "A B C". */
static const char *taken(struct files_watch *watch, int64_t now)
{
    static char text[512];
    struct files_item *item;

    text[0] = '\0';
    assert_int_equal(files_watch_scan(watch, now, NULL), LUMI_OK);
    while (files_watch_next(watch, now, &item)) {
        if (text[0])
            strcat(text, " ");
        strcat(text, item->path);
    }
    return text;
}

static void files_come_in_order_of_their_numbers_once_they_are_still(void **state)
{
    struct files_watch watch;

    (void)state;
    watch_folder(&watch);
    put_jpeg("DSC10.JPG");
    put_jpeg("DSC9.JPG");
    put_jpeg("DSC100.JPG");
    assert_string_equal(taken(&watch, 0), "");
    assert_string_equal(taken(&watch, SECOND / 2), "");
    assert_string_equal(taken(&watch, SECOND), "DSC9.JPG DSC10.JPG DSC100.JPG");
    assert_string_equal(taken(&watch, 9 * SECOND), "");
    files_watch_finish(&watch);
}

static void a_file_that_still_grows_holds_those_after_it_back(void **state)
{
    struct files_watch watch;
    char many[300] = {0};

    (void)state;
    watch_folder(&watch);
    put("A1.ARW", many, 100);
    put_jpeg("A2.JPG");
    assert_string_equal(taken(&watch, 0), "");
    put("A1.ARW", many, 200);
    assert_string_equal(taken(&watch, SECOND), "");
    put("A1.ARW", many, 300);
    assert_string_equal(taken(&watch, 2 * SECOND), "");
    assert_string_equal(taken(&watch, 3 * SECOND), "A1.ARW A2.JPG");
    files_watch_finish(&watch);
}

static void a_jpeg_without_its_end_is_waited_for_long_and_then_taken_as_damaged(void **state)
{
    static const uint8_t half[] = {0xff, 0xd8, 0xff, 0xe0, 0, 2, 1, 2, 3};
    struct files_watch watch;
    struct files_item *item;

    (void)state;
    watch_folder(&watch);
    put("P1.JPG", half, sizeof half);
    assert_string_equal(taken(&watch, 0), "");
    assert_string_equal(taken(&watch, 29 * SECOND), "");
    assert_int_equal(files_watch_scan(&watch, 32 * SECOND, NULL), LUMI_OK);
    assert_true(files_watch_next(&watch, 32 * SECOND, &item));
    assert_false(item->whole);
    files_watch_finish(&watch);
}

static void sidecars_hidden_and_empty_files_are_not_taken(void **state)
{
    struct files_watch watch;

    (void)state;
    watch_folder(&watch);
    put_jpeg(".P1.JPG");
    put_jpeg("P1.XMP");
    put_jpeg("P1.THM");
    put_jpeg("P1.LRV");
    put_jpeg("P1.JPG.part");
    put("P2.JPG", "", 0);
    assert_string_equal(taken(&watch, 0), "");
    assert_string_equal(taken(&watch, 99 * SECOND), "");
    files_watch_finish(&watch);
}

static void a_raw_file_and_its_jpeg_are_one_picture(void **state)
{
    struct files_watch watch;

    (void)state;
    watch_folder(&watch);
    put_jpeg("P1.JPG");
    put("P1.NEF", "raw", 3);
    put("P2.NEF", "raw", 3);
    assert_string_equal(taken(&watch, 0), "");
    assert_string_equal(taken(&watch, SECOND), "P1.NEF P2.NEF");
    put_jpeg("p2.jpg");
    assert_string_equal(taken(&watch, 2 * SECOND), "");
    assert_string_equal(taken(&watch, 9 * SECOND), "");
    files_watch_finish(&watch);
}

static void folders_of_a_card_are_searched_in_their_order(void **state)
{
    struct files_watch watch;
    char path[128];

    (void)state;
    watch_folder(&watch);
    const char *const below[] = {"DCIM", "DCIM/100MSDCF", "DCIM/101MSDCF", "DCIM/99X"};
    for (int i = 0; i < 4; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, below[i]);
        assert_int_equal(mkdir(path, 0700), 0);
    }
    put_jpeg("DCIM/101MSDCF/DSC0001.JPG");
    put_jpeg("DCIM/100MSDCF/DSC9999.JPG");
    put_jpeg("DCIM/99X/DSC5.JPG");
    taken(&watch, 0);
    assert_string_equal(taken(&watch, SECOND), "DCIM/99X/DSC5.JPG DCIM/100MSDCF/DSC9999.JPG DCIM/101MSDCF/DSC0001.JPG");
    files_watch_finish(&watch);
}

static void a_folder_that_vanishes_is_told_and_what_was_taken_is_remembered(void **state)
{
    struct files_watch watch;
    struct lumi_error error;
    char away[80];

    (void)state;
    watch_folder(&watch);
    put_jpeg("P1.JPG");
    put_jpeg("P2.JPG");
    taken(&watch, 0);
    assert_string_equal(taken(&watch, SECOND), "P1.JPG P2.JPG");
    snprintf(away, sizeof away, "%s.away", folder);
    assert_int_equal(rename(folder, away), 0);
    assert_int_equal(files_watch_scan(&watch, 2 * SECOND, &error), LUMI_ERR_IO);
    files_watch_finish(&watch);
    assert_int_equal(files_watch_init(&watch, folder, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(rename(away, folder), 0);
    put_jpeg("P3.JPG");
    watch_folder(&watch);
    taken(&watch, 10 * SECOND);
    assert_string_equal(taken(&watch, 12 * SECOND), "P3.JPG");
    files_watch_finish(&watch);
}

static void numbers_are_read_from_names(void **state)
{
    (void)state;
    assert_int_equal(files_number("DCIM/100/DSC01234.ARW"), 1234);
    assert_int_equal(files_number("GX010042.MP4"), 10042);
    assert_int_equal(files_number("picture.jpg"), 0);
    assert_true(lumi_camera_file_order("a2", "a10") < 0);
    assert_true(lumi_camera_file_order("a10b", "a10") > 0);
    assert_int_equal(lumi_camera_file_order("a1", "a1"), 0);
}

/* ---- through the interface ---- */

static struct lumi_camera *open_camera(const char *options)
{
    struct lumi_camera_setting setting;
    struct lumi_error error = {0};
    struct lumi_camera *camera;
    char address[96];

    snprintf(address, sizeof address, "files:%s", folder);
    if (lumi_camera_open(address, &camera, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    lumi_camera_setting_init(&setting);
    snprintf(setting.options, sizeof setting.options, "%s", options);
    if (camera->ops->configure(camera, &setting, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return camera;
}

/* The next frame, as the camera's thread would wait for it; NULL where none comes in several looks at the folder. */
/* As the host of a camera does: frames until there is none, then it waits. */
static struct lumi_camera_frame *wait_frame(struct lumi_camera *camera, int looks)
{
    struct lumi_camera_frame *frame = NULL;

    for (int i = 0; i < looks; i++) {
        struct pollfd fds[LUMI_CAMERA_POLL];
        assert_int_equal(camera->ops->frame(camera, &frame, NULL), LUMI_OK);
        if (frame)
            return frame;
        int count = camera->ops->poll_fds(camera, fds, LUMI_CAMERA_POLL);
        poll(fds, (nfds_t)count, 2000);
    }
    assert_int_equal(camera->ops->frame(camera, &frame, NULL), LUMI_OK);
    return frame;
}

static void put_dng(const char *name, const char *serial)
{
    static uint8_t pixels[64 * 48];
    struct lumi_head head;
    uint8_t *data;
    size_t size;
    char path[256];

    lumi_head_init(&head);
    head.width = 64;
    head.height = 48;
    head.filter[1] = head.filter[2] = 1;
    head.filter[3] = 2;
    head.exposure_s = 0.004;
    head.iso = 400;
    head.unix_us = INT64_C(1795428318250000);
    head.serial = serial;
    assert_int_equal(lumi_head_make(&head, &data, &size, NULL), LUMI_OK);
    uint8_t *all = malloc(size + sizeof pixels);
    memcpy(all, data, size);
    memcpy(all + size, pixels, sizeof pixels);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(lumi_file_write(path, all, size + sizeof pixels, false, NULL), LUMI_OK);
    free(all);
    lumi_free(data);
}

static void a_new_file_becomes_a_frame_with_what_the_camera_wrote_in_it(void **state)
{
    struct lumi_camera *camera;
    struct lumi_camera_frame *frame;
    char path[128];

    (void)state;
    put_dng("OLD00001.DNG", "A7");
    camera = open_camera("Settle=0");
    assert_true(camera->identity.records_itself);
    assert_int_equal(camera->ops->arm(camera, NULL), LUMI_OK);
    put_dng("DSC00041.DNG", "A7");
    frame = wait_frame(camera, 20);
    assert_non_null(frame);
    snprintf(path, sizeof path, "%s/DSC00041.DNG", folder);
    assert_string_equal(frame->path, path);
    assert_int_equal(frame->format.layout, LUMI_LAYOUT_FILE);
    assert_int_equal(frame->format.width, 64);
    assert_int_equal(frame->format.height, 48);
    assert_int_equal(frame->sequence, 41);
    assert_int_equal(frame->device_ns, INT64_C(1795428318250000000));
    assert_true(frame->exposure_s > 0.00399 && frame->exposure_s < 0.00401 && frame->gain > 3.99);
    assert_false(frame->damaged);
    assert_true(frame->file_mtime_ns > 0);
    put_dng("DSC00044.DNG", "A7");
    struct lumi_camera_frame *second = wait_frame(camera, 20);
    assert_non_null(second);
    assert_int_equal(second->gap, 2);
    lumi_camera_close(camera);
    assert_string_equal(frame->path, path); /* still the taker's */
    lumi_camera_frame_release(frame);
    lumi_camera_frame_release(second);
}

/* They are matched when the sweep is over: until then whoever takes them keeps them all. */
static void all_files_of_a_sweep_can_be_out_at_once(void **state)
{
    struct lumi_camera_frame *frames[300];
    struct lumi_camera *camera;
    char name[32];

    (void)state;
    for (int i = 0; i < 300; i++) {
        snprintf(name, sizeof name, "P%d.DNG", i + 1);
        put_dng(name, "A7");
    }
    camera = open_camera("Settle=0 Take=all");
    assert_int_equal(camera->ops->arm(camera, NULL), LUMI_OK);
    for (unsigned i = 0; i < 300; i++) {
        assert_non_null(frames[i] = wait_frame(camera, 20));
        assert_int_equal(frames[i]->sequence, i + 1);
    }
    assert_null(wait_frame(camera, 3));
    for (int i = 0; i < 300; i++)
        lumi_camera_frame_release(frames[i]);
    lumi_camera_close(camera);
}

static void a_card_pulled_out_goes_on_where_it_was_and_gives_again_what_was_not_stored(void **state)
{
    struct lumi_camera *camera;
    struct lumi_camera_frame *first, *second, *frame = NULL;
    struct lumi_error error;
    char away[80];
    int code = LUMI_OK;

    (void)state;
    for (int i = 1; i <= 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "P%d.DNG", i);
        put_dng(name, "A7");
    }
    camera = open_camera("Settle=0 Take=all");
    assert_int_equal(camera->ops->arm(camera, NULL), LUMI_OK);
    assert_non_null(first = wait_frame(camera, 20));
    lumi_camera_frame_release(first); /* stored */
    assert_non_null(second = wait_frame(camera, 20));
    snprintf(away, sizeof away, "%s.away", folder);
    assert_int_equal(rename(folder, away), 0);
    for (int i = 0; i < 20 && code == LUMI_OK; i++) {
        struct pollfd fd;
        camera->ops->poll_fds(camera, &fd, 1);
        poll(&fd, 1, 2000);
        code = camera->ops->frame(camera, &frame, &error);
        lumi_camera_frame_release(frame);
    }
    assert_int_equal(code, LUMI_ERR_IO);
    lumi_camera_close(camera);
    lumi_camera_frame_release(second); /* its file was gone: it cannot have been stored */
    assert_int_equal(rename(away, folder), 0);
    camera = open_camera("Settle=0 Take=all");
    assert_int_equal(camera->ops->arm(camera, NULL), LUMI_OK);
    bool again = false;
    while ((frame = wait_frame(camera, 3)) != NULL) {
        assert_int_not_equal(frame->sequence, 1);
        again = again || frame->sequence == 2;
        lumi_camera_frame_release(frame);
    }
    assert_true(again);
    lumi_camera_close(camera);
}

static void a_picture_of_another_camera_is_refused_by_name(void **state)
{
    struct lumi_camera *camera;
    struct lumi_camera_frame *frame;
    struct lumi_error error = {0};

    (void)state;
    put_dng("P1.DNG", "A7");
    put_dng("P2.DNG", "B8");
    put_dng("P3.DNG", "A7");
    camera = open_camera("Settle=0 Take=all");
    assert_int_equal(camera->ops->arm(camera, NULL), LUMI_OK);
    assert_non_null(frame = wait_frame(camera, 20));
    lumi_camera_frame_release(frame);
    assert_int_equal(camera->ops->frame(camera, &frame, &error), LUMI_ERR_FORMAT);
    assert_null(frame);
    assert_non_null(strstr(error.text, "P2.DNG"));
    assert_non_null(strstr(error.text, "B8"));
    assert_non_null(frame = wait_frame(camera, 20));
    assert_int_equal(frame->sequence, 3);
    lumi_camera_frame_release(frame);
    lumi_camera_close(camera);
}

static void what_cannot_be_asked_of_it_is_refused(void **state)
{
    struct lumi_camera *camera = open_camera("");
    struct lumi_camera_setting setting;
    struct lumi_camera_status status;
    struct lumi_error error;

    (void)state;
    assert_int_equal(camera->ops->trigger(camera, &error), LUMI_ERR_UNSUPPORTED);
    lumi_camera_setting_init(&setting);
    setting.trigger = LUMI_TRIGGER_SOFTWARE;
    assert_int_equal(camera->ops->configure(camera, &setting, &error), LUMI_ERR_UNSUPPORTED);
    setting.trigger = LUMI_TRIGGER_HARDWARE;
    snprintf(setting.options, sizeof setting.options, "Take=some");
    assert_int_equal(camera->ops->configure(camera, &setting, &error), LUMI_ERR_ARG);
    assert_int_equal(camera->ops->status(camera, &status, &error), LUMI_OK);
    assert_true(status.card_free_bytes >= 0);
    lumi_camera_close(camera);
    assert_int_equal(lumi_camera_open("files:/nowhere/at/all", &camera, &error), LUMI_ERR_NOTFOUND);
}

#define WITH_FOLDER(test) cmocka_unit_test_setup_teardown(test, make_folder, remove_folder)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_FOLDER(files_come_in_order_of_their_numbers_once_they_are_still),
        WITH_FOLDER(a_file_that_still_grows_holds_those_after_it_back),
        WITH_FOLDER(a_jpeg_without_its_end_is_waited_for_long_and_then_taken_as_damaged),
        WITH_FOLDER(sidecars_hidden_and_empty_files_are_not_taken),
        WITH_FOLDER(a_raw_file_and_its_jpeg_are_one_picture),
        WITH_FOLDER(folders_of_a_card_are_searched_in_their_order),
        WITH_FOLDER(a_folder_that_vanishes_is_told_and_what_was_taken_is_remembered),
        WITH_FOLDER(numbers_are_read_from_names),
        WITH_FOLDER(a_new_file_becomes_a_frame_with_what_the_camera_wrote_in_it),
        WITH_FOLDER(all_files_of_a_sweep_can_be_out_at_once),
        WITH_FOLDER(a_card_pulled_out_goes_on_where_it_was_and_gives_again_what_was_not_stored),
        WITH_FOLDER(a_picture_of_another_camera_is_refused_by_name),
        WITH_FOLDER(what_cannot_be_asked_of_it_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
