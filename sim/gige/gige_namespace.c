/* Network namespaces: namespaces(7), user_namespaces(7). */
#define _GNU_SOURCE /* unshare */
#include "sim/gige/gige_namespace.h"

#include "proto/base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

static int put_file(const char *path, const char *text)
{
    const int fd = open(path, O_WRONLY | O_CLOEXEC);
    const int code = fd < 0 ? -1 : lumi_write_all(fd, text, strlen(text));

    if (fd >= 0)
        close(fd);
    return code;
}

/* Root of a user namespace of its own, as unshare --map-root-user does. */
static int unshare_as_user(uid_t user, gid_t group)
{
    char map[64];

    if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0)
        return -1;
    (void)put_file("/proc/self/setgroups", "deny"); /* kernels before 3.19 have none */
    snprintf(map, sizeof map, "0 %u 1", (unsigned)user);
    if (put_file("/proc/self/uid_map", map) != 0)
        return -1;
    snprintf(map, sizeof map, "0 %u 1", (unsigned)group);
    return put_file("/proc/self/gid_map", map);
}

static int loopback_up(void)
{
    struct ifreq request = {.ifr_name = "lo"};
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    int code;

    if (fd < 0)
        return -1;
    code = ioctl(fd, SIOCGIFFLAGS, &request);
    request.ifr_flags |= IFF_UP;
    if (code == 0)
        code = ioctl(fd, SIOCSIFFLAGS, &request);
    close(fd);
    return code;
}

int sim_gige_own_network(struct lumi_error *error)
{
    const uid_t user = getuid();
    const gid_t group = getgid();

    if (unshare(CLONE_NEWNET) != 0 && unshare_as_user(user, group) != 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "a network namespace cannot be had: %s (it needs root, or user namespaces: "
                         "sysctl kernel.unprivileged_userns_clone)",
                         strerror(errno));
    if (loopback_up() != 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "the namespace's loopback network does not come up: %s",
                         strerror(errno));
    return LUMI_OK;
}
