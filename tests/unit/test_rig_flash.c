/* daemon/rig/flash: images that are refused, and a board that is flashed by a program which stands in for dfu-util. */
#include "daemon/rig/flash.h"
#include "fake_board.h"
#include "proto/base/bytes.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#define IMAGE 2048

static char folder[] = "/tmp/lumi-flash-XXXXXX";
static char image_path[64], program_path[64], done_path[64];
static struct fake_board board;
static const char *comes_back_as;

static void put_u32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> 8 * i);
}

static void make_image(uint8_t *image, const char *name, const char *firmware)
{
    uint8_t *header = image + BOARD_IMAGE_OFFSET;

    for (int i = 0; i < IMAGE; i++)
        image[i] = (uint8_t)(i * 7);
    memset(header, 0, sizeof(struct board_image));
    memcpy(header, BOARD_IMAGE_MAGIC, 8);
    put_u32(header + 8, BOARD_IMAGE_VERSION);
    put_u32(header + BOARD_IMAGE_SIZE_AT, IMAGE);
    put_u32(header + BOARD_IMAGE_ADDRESS_AT, 0x08000000);
    snprintf((char *)header + BOARD_IMAGE_BOARD_AT, BOARD_IMAGE_NAME, "%s", name);
    snprintf((char *)header + BOARD_IMAGE_FIRMWARE_AT, BOARD_IMAGE_FIRMWARE, "%s", firmware);
    put_u32(header + BOARD_IMAGE_CRC_AT, lumi_crc32c(0, image, IMAGE));
}

static void refused(const uint8_t *image, size_t size, int wanted, const char *words)
{
    struct board_image header;
    struct lumi_error error = {0};

    /* Exactly so much memory: reading beyond is seen by the sanitizers. */
    uint8_t *copy = malloc(size ? size : 1);
    memcpy(copy, image, size);
    assert_int_equal(lumi_rig_image_check(copy, size, "f.bin", "host", &header, &error), wanted);
    free(copy);
    if (!strstr(error.text, words))
        fail_msg("'%s' is not in: %s", words, error.text);
}

static void images_that_are_cut_damaged_or_anothers_are_refused(void **state)
{
    uint8_t image[IMAGE + 4] = {0};
    struct board_image header;
    struct lumi_error error = {0};

    (void)state;
    make_image(image, "host", "1.2.3");
    assert_int_equal(lumi_rig_image_check(image, IMAGE, "f.bin", "host", &header, &error), LUMI_OK);
    assert_string_equal(header.firmware, "1.2.3");
    for (size_t size = 0; size < BOARD_IMAGE_OFFSET + sizeof header; size += 37)
        refused(image, size, LUMI_ERR_FORMAT, "no firmware of a rig");
    refused(image, IMAGE - 4, LUMI_ERR_FORMAT, "it is cut");
    refused(image, IMAGE + 4, LUMI_ERR_FORMAT, "it is cut");
    for (int at = 0; at < IMAGE; at += 61) {
        make_image(image, "host", "1.2.3");
        image[at] ^= 0x10;
        if (at < BOARD_IMAGE_OFFSET || at >= BOARD_IMAGE_OFFSET + 64)
            refused(image, IMAGE, LUMI_ERR_CHECKSUM, "damaged");
        else
            assert_int_not_equal(lumi_rig_image_check(image, IMAGE, "f", "host", &header, &error), LUMI_OK);
    }
    make_image(image, "stm32f405", "1.2.3");
    refused(image, IMAGE, LUMI_ERR_FORMAT, "is for a board 'stm32f405', this one is 'host'");
    make_image(image, "host", "1.2.3");
    image[BOARD_IMAGE_OFFSET + 8] = 2;
    refused(image, IMAGE, LUMI_ERR_VERSION, "layout 2");
}

/* ---- flashing ---- */

static bool entered, restarted, allow_older;
static const char *runs = "1.2.2";
static bool (*interrupted)(void *context);

static void execute(struct fake_board *self, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    if (request->which_command == lumi_wire_Request_get_status_tag) {
        reply->which_payload = lumi_wire_Reply_status_tag;
        reply->payload.status = self->status;
    } else if (request->which_command == lumi_wire_Request_enter_loader_tag) {
        entered = self->mute = true;
    }
}

/* In the loader the board hears nothing; when the program has written, it starts with what was written. */
static void idle(struct fake_board *self)
{
    if (!entered || restarted || access(done_path, F_OK))
        return;
    restarted = true;
    self->mute = false;
    self->identity.boot++;
    snprintf(self->identity.firmware, sizeof self->identity.firmware, "%s", comes_back_as);
    lumi_wire_Welcome identity = self->identity;
    const struct lumi_wire_server_ops *ops = self->server.ops;
    lumi_wire_server_init(&self->server, ops, self, &identity);
}

static void write_program(const char *lines)
{
    char text[512];

    snprintf(text, sizeof text, "#!/bin/sh\n%s\n", lines);
    assert_int_equal(lumi_file_write(program_path, text, strlen(text), false, NULL), LUMI_OK);
    assert_false(chmod(program_path, 0755));
}

static int flash(const char *program_lines, struct lumi_error *error)
{
    uint8_t image[IMAGE];
    struct lumi_rig_flash flash;
    char lines[300];
    int code;

    memset(&board, 0, sizeof board);
    entered = restarted = false;
    snprintf(board.identity.board, sizeof board.identity.board, "host");
    snprintf(board.identity.firmware, sizeof board.identity.firmware, "%s", runs);
    unlink(done_path);
    board.execute = execute;
    board.idle = idle;
    board.status.state = lumi_wire_State_IDLE;
    fake_board_start(&board, "pty");
    make_image(image, "host", "1.2.3");
    assert_int_equal(lumi_file_write(image_path, image, IMAGE, false, NULL), LUMI_OK);
    snprintf(lines, sizeof lines, program_lines, done_path);
    write_program(lines);
    lumi_rig_flash_init(&flash);
    flash.path = image_path;
    flash.program = program_path;
    flash.loader_seconds = 20;
    flash.older = allow_older;
    flash.cancelled = interrupted;
    flash.restart_seconds = 20;
    assert_int_equal(lumi_rig_link_open(board.address, NULL, &flash.link, error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(flash.link, 20, false, error), LUMI_OK);
    code = lumi_rig_flash(&flash, error);
    lumi_rig_link_close(flash.link);
    fake_board_stop(&board);
    return code;
}

static void a_board_is_flashed_and_says_the_new_version(void **state)
{
    struct lumi_error error = {0};
    uint8_t *said;
    size_t size;
    char wanted[200];

    (void)state;
    comes_back_as = "1.2.3";
    if (flash("echo \"$@\" >%s", &error))
        fail_msg("%s", error.text);
    assert_int_equal(lumi_file_read(done_path, 4096, &said, &size, &error), LUMI_OK);
    snprintf(wanted, sizeof wanted, "-w -a 0 -d 0483:df11 -s 0x08000000:leave -D %s\n", image_path);
    assert_string_equal((char *)said, wanted);
    lumi_free(said);
}

static void a_board_that_comes_back_with_another_version_is_told(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    comes_back_as = "1.2.2";
    assert_int_equal(flash("echo >%s", &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "flashed 1.2.3, but the board runs 1.2.2"));
}

static void versions_are_compared_where_that_is_clear(void **state)
{
    (void)state;
    assert_true(lumi_rig_version_older("1.2.3", "1.10.0"));
    assert_true(lumi_rig_version_older("0.9.9", "1.0.0"));
    assert_false(lumi_rig_version_older("1.2.3", "1.2.3"));
    assert_false(lumi_rig_version_older("2.0.0", "1.9.9"));
    assert_false(lumi_rig_version_older("1.2", "1.9.9"));
    assert_false(lumi_rig_version_older("1.2.3-rc1", "1.9.9"));
    assert_false(lumi_rig_version_older("1.2.3", "unknown"));
    assert_false(lumi_rig_version_older("1.2.99999999999", "2.0.0"));
}

static void an_older_version_is_written_only_if_that_is_said(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    runs = "1.3.0";
    comes_back_as = "1.2.3";
    assert_int_equal(flash("echo >%s", &error), LUMI_ERR_VERSION);
    assert_non_null(strstr(error.text, "1.2.3 is older than the board's 1.3.0"));
    assert_false(entered);
    allow_older = true;
    assert_int_equal(flash("echo >%s", &error), LUMI_OK);
    allow_older = false;
    runs = "1.2.2";
}

static bool while_it_writes(void *context)
{
    (void)context;
    return access(done_path, F_OK) == 0;
}

static void who_interrupts_the_writing_is_told_how_to_go_on(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    comes_back_as = "1.2.3";
    interrupted = while_it_writes;
    assert_int_equal(flash("echo >%s; exec sleep 1000", &error), LUMI_ERR_CANCELLED);
    assert_non_null(strstr(error.text, "waits in its loader: lumi rig flash --in-loader"));
    assert_true(entered);
    interrupted = NULL;
}

static void what_the_writing_program_says_is_passed_on(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(flash(": %s; echo 'No DFU capable'; echo 'USB device' >&2; exit 74", &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "No DFU capable USB device"));
    assert_true(entered);
}

static void a_writing_program_that_hangs_is_ended(void **state)
{
    struct lumi_rig_flash flash_in_loader;
    struct lumi_error error = {0};

    (void)state;
    write_program("echo Waiting for device; exec sleep 1000");
    lumi_rig_flash_init(&flash_in_loader);
    flash_in_loader.path = image_path;
    flash_in_loader.program = program_path;
    flash_in_loader.loader_seconds = 0.3;
    assert_int_equal(lumi_rig_flash(&flash_in_loader, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "Waiting for device"));
    flash_in_loader.program = "lumi-no-such-program";
    assert_int_equal(lumi_rig_flash(&flash_in_loader, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "not installed"));
}

static void nothing_is_flashed_while_the_rig_moves_or_without_the_program(void **state)
{
    struct lumi_rig_flash moving;
    struct lumi_error error = {0};

    (void)state;
    memset(&board, 0, sizeof board);
    entered = false;
    board.execute = execute;
    snprintf(board.identity.board, sizeof board.identity.board, "host");
    board.status.state = lumi_wire_State_SWEEPING;
    fake_board_start(&board, "pty");
    lumi_rig_flash_init(&moving);
    moving.path = image_path;
    moving.program = program_path;
    assert_int_equal(lumi_rig_link_open(board.address, NULL, &moving.link, &error), LUMI_OK);
    assert_int_equal(lumi_rig_link_wait(moving.link, 20, false, &error), LUMI_OK);
    assert_int_equal(lumi_rig_flash(&moving, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "sweeping"));
    assert_false(entered);
    pthread_mutex_lock(&board.lock);
    board.status.state = lumi_wire_State_IDLE;
    pthread_mutex_unlock(&board.lock);
    moving.program = "lumi-no-such-program"; /* known before the board is in its loader */
    assert_int_equal(lumi_rig_flash(&moving, &error), LUMI_ERR_IO);
    assert_non_null(strstr(error.text, "not installed"));
    assert_false(entered);
    lumi_rig_link_close(moving.link);
    fake_board_stop(&board);
}

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(image_path, sizeof image_path, "%s/image", folder);
    snprintf(program_path, sizeof program_path, "%s/program", folder);
    snprintf(done_path, sizeof done_path, "%s/done", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(image_path);
    unlink(program_path);
    unlink(done_path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(images_that_are_cut_damaged_or_anothers_are_refused),
        cmocka_unit_test(a_board_is_flashed_and_says_the_new_version),
        cmocka_unit_test(a_board_that_comes_back_with_another_version_is_told),
        cmocka_unit_test(versions_are_compared_where_that_is_clear),
        cmocka_unit_test(an_older_version_is_written_only_if_that_is_said),
        cmocka_unit_test(who_interrupts_the_writing_is_told_how_to_go_on),
        cmocka_unit_test(what_the_writing_program_says_is_passed_on),
        cmocka_unit_test(a_writing_program_that_hangs_is_ended),
        cmocka_unit_test(nothing_is_flashed_while_the_rig_moves_or_without_the_program),
    };

    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
