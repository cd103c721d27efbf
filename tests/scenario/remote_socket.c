/* Messages over a socket, whole or not at all. */
#include "remote_engine.h"

#include <errno.h>
#include <sys/socket.h>
#include <unistd.h>

bool remote_read(int fd, void *data, size_t size)
{
    for (size_t got = 0; got < size;) {
        ssize_t n = read(fd, (char *)data + got, size - got);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        got += (size_t)n;
    }
    return true;
}

static bool write_all(int fd, const void *data, size_t size)
{
    for (size_t sent = 0; sent < size;) {
        ssize_t n = send(fd, (const char *)data + sent, size - sent, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return false;
        sent += (size_t)n;
    }
    return true;
}

bool remote_write(int fd, enum remote_op op, const void *data, size_t size, const void *more, size_t more_size)
{
    struct remote_head head = {op, (uint32_t)(size + more_size)};

    return write_all(fd, &head, sizeof head) && write_all(fd, data, size) &&
           (!more_size || write_all(fd, more, more_size));
}
