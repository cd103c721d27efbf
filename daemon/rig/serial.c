/* A serial line in raw mode, held exclusively. termios(3), ioctl_tty(2), the kernel's serial-rs485 document. */
#define _DEFAULT_SOURCE /* cfmakeraw, CRTSCTS, rates above 38400 */
#include "daemon/rig/stream.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <linux/serial.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

struct serial_stream {
    struct lumi_rig_stream base;
    char *path;
    struct lumi_rig_serial_settings settings;
    int fd;
};

static const struct {
    int baud;
    speed_t speed;
} rates[] = {
    {9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},     {115200, B115200},
    {230400, B230400},   {460800, B460800},   {500000, B500000},   {576000, B576000},   {921600, B921600},
    {1000000, B1000000}, {1500000, B1500000}, {2000000, B2000000}, {3000000, B3000000}, {4000000, B4000000},
};

static bool find_speed(int baud, speed_t *speed)
{
    for (size_t i = 0; i < sizeof rates / sizeof rates[0]; i++)
        if (rates[i].baud == baud) {
            *speed = rates[i].speed;
            return true;
        }
    return false;
}

/* The process that older programs say holds a line: a file of its number (Filesystem Hierarchy Standard 3.0, 5.9). 0:
 * nobody, or somebody who is gone. */
static int lock_file_holder(const char *path)
{
    g_autofree char *name = g_path_get_basename(path);
    g_autofree char *lock = g_strdup_printf("/var/lock/LCK..%s", name);
    char text[16] = "";
    FILE *file = fopen(lock, "re");
    int holder;

    if (!file)
        return 0;
    if (!fgets(text, sizeof text, file))
        text[0] = '\0';
    fclose(file);
    holder = atoi(text);
    if (holder <= 0 || holder == getpid() || (kill(holder, 0) && errno == ESRCH))
        return 0;
    return holder;
}

static int refuse_open(const char *path, struct lumi_error *error)
{
    if (errno == EBUSY)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it open for itself", path);
    if (errno == EACCES)
        return lumi_fail(error, LUMI_ERR_IO,
                         "%s: no permission (be in the group 'dialout', or install 70-lumirig.rules)", path);
    if (errno == ENXIO || errno == ENODEV)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: nothing is plugged in there", path);
    return lumi_fail_errno(error, path, "open");
}

static int set_raw(struct serial_stream *self, struct lumi_error *error)
{
    struct termios settings;
    speed_t speed = B115200;

    find_speed(self->settings.baud, &speed);
    if (tcgetattr(self->fd, &settings))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no serial line", self->path);
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~(tcflag_t)(CRTSCTS | CSTOPB | PARENB | HUPCL);
    settings.c_cc[VMIN] = 1;
    settings.c_cc[VTIME] = 0;
    if (cfsetispeed(&settings, speed) || cfsetospeed(&settings, speed) || tcsetattr(self->fd, TCSANOW, &settings))
        return lumi_fail(error, LUMI_ERR_IO, "%s: it does not do %d baud", self->path, self->settings.baud);
    /* What stood in the buffers is from before: the frames would survive it, but it says nothing about this board. */
    tcflush(self->fd, TCIOFLUSH);
    return LUMI_OK;
}

static int set_rs485(struct serial_stream *self, struct lumi_error *error)
{
    struct serial_rs485 rs485 = {.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND};

    if (!self->settings.rs485)
        return LUMI_OK;
    if (ioctl(self->fd, TIOCSRS485, &rs485))
        return lumi_fail(error, LUMI_ERR_IO,
                         "%s: its driver has no RS-485 (%s); adapters that switch by themselves need no 'rs485'",
                         self->path, strerror(errno));
    return LUMI_OK;
}

static int serial_open(struct lumi_rig_stream *stream, struct lumi_error *error)
{
    struct serial_stream *self = (struct serial_stream *)stream;
    struct stat status;
    int code, holder = lock_file_holder(self->path);

    if (holder)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: process %d has it (its lock file says)", self->path, holder);
    if (!stat(self->path, &status) && !S_ISCHR(status.st_mode))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no serial line", self->path);
    /* Non-blocking: a line that waits for its carrier would hang here. */
    self->fd = open(self->path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (self->fd < 0)
        return refuse_open(self->path, error);
    if (flock(self->fd, LOCK_EX | LOCK_NB)) {
        code = lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it locked (lumid?)", self->path);
        goto fail;
    }
    LUMI_GOTO(code, fail, set_raw(self, error));
    LUMI_GOTO(code, fail, set_rs485(self, error));
    ioctl(self->fd, TIOCEXCL); /* not for pseudo-terminals of every kernel: the lock above is what counts */
    return LUMI_OK;
fail:
    close(self->fd);
    self->fd = -1;
    return code;
}

static void serial_close(struct lumi_rig_stream *stream)
{
    struct serial_stream *self = (struct serial_stream *)stream;

    if (self->fd >= 0) {
        ioctl(self->fd, TIOCNXCL);
        tcflush(self->fd, TCOFLUSH); /* close(2) would wait for what a dead line never takes */
        close(self->fd);
    }
    self->fd = -1;
}

static int serial_poll_fds(struct lumi_rig_stream *stream, struct pollfd *fds, int max, bool write)
{
    struct serial_stream *self = (struct serial_stream *)stream;

    if (self->fd < 0 || max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = self->fd, .events = (short)(POLLIN | (write ? POLLOUT : 0))};
    return 1;
}

static long serial_read(struct lumi_rig_stream *stream, uint8_t *data, size_t size, struct lumi_error *error)
{
    return lumi_rig_fd_read(((struct serial_stream *)stream)->fd, stream->name, data, size, error);
}

static long serial_write(struct lumi_rig_stream *stream, const uint8_t *data, size_t size, struct lumi_error *error)
{
    return lumi_rig_fd_write(((struct serial_stream *)stream)->fd, stream->name, data, size, error);
}

static void serial_destroy(struct lumi_rig_stream *stream)
{
    struct serial_stream *self = (struct serial_stream *)stream;

    g_free(self->path);
    g_free(self);
}

static const struct lumi_rig_stream_ops serial_ops = {
    .open = serial_open,
    .close = serial_close,
    .poll_fds = serial_poll_fds,
    .read = serial_read,
    .write = serial_write,
    .destroy = serial_destroy,
};

int lumi_rig_serial_create(const char *path, const struct lumi_rig_serial_settings *settings,
                           struct lumi_rig_stream **stream, struct lumi_error *error)
{
    struct serial_stream *self;
    speed_t speed;

    if (!find_speed(settings->baud, &speed))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: %d baud is no rate of a serial line", path, settings->baud);
    self = g_new0(struct serial_stream, 1);
    self->base.ops = &serial_ops;
    self->path = g_strdup(path);
    self->settings = *settings;
    self->fd = -1;
    snprintf(self->base.name, sizeof self->base.name, "%s", path);
    *stream = &self->base;
    return LUMI_OK;
}
