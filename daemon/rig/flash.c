/* Flashing a board. */
#include "daemon/rig/flash.h"
#include "daemon/rig/bench.h"
#include "daemon/rig/link_priv.h"
#include "proto/base/bytes.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

#define LOADER_DEVICE "0483:df11" /* AN2606: the vendor and product of the system memory's DFU */
#define GONE_SECONDS 5.0          /* for the board to leave the bus */

/* ---- the image ---- */

int lumi_rig_image_check(const uint8_t *data, size_t size, const char *source, const char *board,
                         struct board_image *image, struct lumi_error *error)
{
    static const uint8_t zero[4];
    const uint8_t *header = data + BOARD_IMAGE_OFFSET;
    struct lumi_reader reader;
    uint32_t crc;

    memset(image, 0, sizeof *image);
    if (size < BOARD_IMAGE_OFFSET + sizeof *image || memcmp(header, BOARD_IMAGE_MAGIC, sizeof image->magic) != 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no firmware of a rig", source);
    lumi_reader_init(&reader, header + sizeof image->magic, sizeof *image - sizeof image->magic);
    memcpy(image->magic, header, sizeof image->magic);
    image->version = lumi_read_u32(&reader);
    image->size = lumi_read_u32(&reader);
    image->address = lumi_read_u32(&reader);
    image->crc = lumi_read_u32(&reader);
    memcpy(image->board, header + BOARD_IMAGE_BOARD_AT, sizeof image->board - 1);
    memcpy(image->firmware, header + BOARD_IMAGE_FIRMWARE_AT, sizeof image->firmware - 1);
    lumi_wire_clean_text(image->board, sizeof image->board);
    lumi_wire_clean_text(image->firmware, sizeof image->firmware);
    if (image->version != BOARD_IMAGE_VERSION)
        return lumi_fail(error, LUMI_ERR_VERSION, "%s: a firmware image of layout %u, this program knows %d", source,
                         (unsigned)image->version, BOARD_IMAGE_VERSION);
    if (image->size != size)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: %zu bytes, its header says %u: it is cut", source, size,
                         (unsigned)image->size);
    crc = lumi_crc32c(0, data, BOARD_IMAGE_OFFSET + BOARD_IMAGE_CRC_AT);
    crc = lumi_crc32c(crc, zero, sizeof zero);
    crc = lumi_crc32c(crc, header + BOARD_IMAGE_CRC_AT + 4, size - BOARD_IMAGE_OFFSET - BOARD_IMAGE_CRC_AT - 4);
    if (crc != image->crc)
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: does not match its checksum: it is damaged", source);
    if (board && strcmp(board, image->board) != 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is for a board '%s', this one is '%s'", source, image->board,
                         board);
    return LUMI_OK;
}

static bool read_version(const char *text, uint32_t numbers[3])
{
    for (int i = 0; i < 3; i++) {
        char *end;
        if (!g_ascii_isdigit(*text))
            return false;
        uint64_t number = g_ascii_strtoull(text, &end, 10);
        if (number > UINT32_MAX || *end != (i < 2 ? '.' : '\0'))
            return false;
        numbers[i] = (uint32_t)number;
        text = end + 1;
    }
    return true;
}

bool lumi_rig_version_older(const char *version, const char *other)
{
    uint32_t a[3], b[3];

    if (!read_version(version, a) || !read_version(other, b))
        return false;
    for (int i = 0; i < 3; i++)
        if (a[i] != b[i])
            return a[i] < b[i];
    return false;
}

/* ---- dfu-util ---- */

/* The end of what it said, on one line. */
struct tail {
    char text[400];
    size_t used;
};

static void keep_tail(struct tail *tail, const char *data, size_t size)
{
    for (size_t i = 0; i < size; i++) {
        char c = data[i] == '\n' || data[i] == '\r' ? ' ' : data[i];
        if (c == ' ' && (!tail->used || tail->text[tail->used - 1] == ' '))
            continue;
        if (tail->used == sizeof tail->text - 1)
            memmove(tail->text, tail->text + 1, --tail->used);
        tail->text[tail->used++] = c;
    }
    tail->text[tail->used] = '\0';
    lumi_wire_clean_text(tail->text, sizeof tail->text);
}

static int spawn(const char *program, char *const *arguments, int *output, pid_t *child, struct lumi_error *error)
{
    posix_spawn_file_actions_t actions;
    int pipes[2], failed;

    if (pipe(pipes))
        return lumi_fail_errno(error, program, "pipe");
    fcntl(pipes[0], F_SETFD, FD_CLOEXEC);
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, pipes[1], 1);
    posix_spawn_file_actions_adddup2(&actions, pipes[1], 2);
    posix_spawn_file_actions_addclose(&actions, pipes[1]);
    failed = posix_spawnp(child, program, &actions, NULL, arguments, environ);
    posix_spawn_file_actions_destroy(&actions);
    close(pipes[1]);
    *output = pipes[0];
    if (!failed)
        return LUMI_OK;
    close(pipes[0]);
    if (failed == ENOENT)
        return lumi_fail(error, LUMI_ERR_IO, "%s is not installed (package dfu-util)", program);
    errno = failed;
    return lumi_fail_errno(error, program, "start");
}

static bool cancelled(const struct lumi_rig_flash *flash)
{
    return flash->cancelled && flash->cancelled(flash->context);
}

/* Reads until it ends; false: it did not in time, or nobody wants it any more. */
static bool read_until_end(int output, const struct lumi_rig_flash *flash, struct tail *tail)
{
    uint64_t deadline = lumi_rig_link_now() + (uint64_t)(flash->loader_seconds * 1e9);
    struct pollfd one = {.fd = output, .events = POLLIN};
    char data[512];

    for (;;) {
        uint64_t now = lumi_rig_link_now();
        if (now >= deadline || cancelled(flash))
            return false;
        if (poll(&one, 1, (int)MIN((deadline - now) / 1000000 + 1, 200)) <= 0)
            continue;
        ssize_t count = read(output, data, sizeof data);
        if (count <= 0 && !(count < 0 && errno == EINTR))
            return true;
        if (count > 0)
            keep_tail(tail, data, (size_t)count);
    }
}

static int run_dfu_util(const struct lumi_rig_flash *flash, struct lumi_error *error)
{
    g_autofree char *address = g_strdup_printf("0x%08x:leave", (unsigned)flash->image.address);
    char *arguments[] = {(char *)(uintptr_t)flash->program,
                         (char *)(uintptr_t) "-w",
                         (char *)(uintptr_t) "-a",
                         (char *)(uintptr_t) "0",
                         (char *)(uintptr_t) "-d",
                         (char *)(uintptr_t)LOADER_DEVICE,
                         (char *)(uintptr_t) "-s",
                         address,
                         (char *)(uintptr_t) "-D",
                         (char *)(uintptr_t)flash->path,
                         NULL};
    struct tail tail = {.used = 0};
    bool ended;
    pid_t child;
    int output = -1, status = 0;

    LUMI_TRY(spawn(flash->program, arguments, &output, &child, error));
    ended = read_until_end(output, flash, &tail);
    close(output);
    if (!ended)
        kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    if ((!ended || !WIFEXITED(status) || WEXITSTATUS(status) != 0) && cancelled(flash)) /* Ctrl-C reaches both */
        return lumi_fail(error, LUMI_ERR_CANCELLED,
                         "interrupted; the board waits in its loader: lumi rig flash --in-loader %s", flash->path);
    if (!ended)
        return lumi_fail(error, LUMI_ERR_IO,
                         "%s did not end within %.3g s; is the board's USB plugged in? It waits in its loader: run "
                         "flash --in-loader. %s",
                         flash->program, flash->loader_seconds, tail.text);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        return lumi_fail(error, LUMI_ERR_IO, "%s failed; the board waits in its loader: run flash --in-loader. %s",
                         flash->program, tail.text);
    return LUMI_OK;
}

/* ---- the board ---- */

/* Before the board goes to its loader, where nothing else can be done with it. */
static int find_program(const struct lumi_rig_flash *flash, struct lumi_error *error)
{
    g_autofree char *path = g_find_program_in_path(flash->program);

    return path ? LUMI_OK : lumi_fail(error, LUMI_ERR_IO, "%s is not installed (package dfu-util)", flash->program);
}

void lumi_rig_flash_init(struct lumi_rig_flash *flash)
{
    *flash = (struct lumi_rig_flash){.program = "dfu-util", .loader_seconds = 120, .restart_seconds = 30};
}

static void say(const struct lumi_rig_flash *flash, const char *what)
{
    if (flash->progress)
        flash->progress(flash->context, what);
}

/* The board leaves at once: its answer may not come through, and then nobody is there. */
static int enter_loader(const struct lumi_rig_flash *flash, struct lumi_error *error)
{
    const lumi_wire_Request request = {.which_command = lumi_wire_Request_enter_loader_tag};
    lumi_wire_Status status;
    int code;

    LUMI_TRY(lumi_rig_bench_status(flash->link, &status, error));
    if (!lumi_rig_state_at_rest(status.state))
        return lumi_fail(error, LUMI_ERR_BUSY, "not while the board is %s", lumi_wire_state_name(status.state));
    if (cancelled(flash))
        return lumi_fail(error, LUMI_ERR_CANCELLED, "interrupted; the board is as it was");
    code = lumi_rig_link_command(flash->link, &request, GONE_SECONDS, NULL, error);
    return code == LUMI_ERR_IO ? LUMI_OK : code;
}

static int await_board(const struct lumi_rig_flash *flash, uint32_t boot, struct lumi_error *error)
{
    uint64_t deadline = lumi_rig_link_now() + (uint64_t)(flash->restart_seconds * 1e9);
    struct lumi_rig_link_snapshot snapshot;
    struct lumi_rig_notice notice;

    for (;;) {
        lumi_rig_link_notice(flash->link, 0.1, &notice);
        lumi_rig_link_snapshot(flash->link, &snapshot);
        if (snapshot.state == LUMI_RIG_LINK_OPEN && snapshot.welcome.boot != boot)
            break;
        if (snapshot.state == LUMI_RIG_LINK_VERSION)
            return lumi_fail(error, LUMI_ERR_VERSION, "flashed; %s", snapshot.text);
        if (cancelled(flash))
            return lumi_fail(error, LUMI_ERR_CANCELLED, "flashed; interrupted before the board was back");
        if (lumi_rig_link_now() >= deadline)
            return lumi_fail(error, LUMI_ERR_IO, "flashed, but the board has not come back within %.3g s: %s",
                             flash->restart_seconds, snapshot.text[0] ? snapshot.text : "it has not restarted");
    }
    if (strcmp(snapshot.welcome.firmware, flash->image.firmware) != 0)
        return lumi_fail(error, LUMI_ERR_IO, "flashed %s, but the board runs %s", flash->image.firmware,
                         snapshot.welcome.firmware);
    return LUMI_OK;
}

int lumi_rig_flash(struct lumi_rig_flash *flash, struct lumi_error *error)
{
    struct lumi_rig_link_snapshot snapshot = {0};
    uint8_t *data = NULL;
    size_t size;
    int code;

    if (flash->link)
        lumi_rig_link_snapshot(flash->link, &snapshot);
    LUMI_TRY(lumi_file_read(flash->path, LUMI_RIG_IMAGE_MAX, &data, &size, error));
    code = lumi_rig_image_check(data, size, flash->path, flash->link ? snapshot.welcome.board : NULL, &flash->image,
                                error);
    lumi_free(data);
    LUMI_TRY(code);
    if (flash->link && !flash->older && lumi_rig_version_older(flash->image.firmware, snapshot.welcome.firmware))
        return lumi_fail(error, LUMI_ERR_VERSION, "%s: firmware %s is older than the board's %s (--older writes it)",
                         flash->path, flash->image.firmware, snapshot.welcome.firmware);
    LUMI_TRY(find_program(flash, error));
    if (flash->link) {
        say(flash, "entering the loader");
        LUMI_TRY(enter_loader(flash, error));
    }
    say(flash, "writing");
    LUMI_TRY(run_dfu_util(flash, error));
    if (!flash->link)
        return LUMI_OK;
    say(flash, "waiting for the board");
    return await_board(flash, snapshot.welcome.boot, error);
}
