/* A process that asks for nothing others want. */
#define _GNU_SOURCE /* SCHED_IDLE, syscall */
#include "pipeline/preview/preview_serve.h"

#include <fcntl.h>
#include <sched.h>
#include <stdio.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

/* Private memory that can be written now, bytes: proc(5), /proc/pid/statm, field 6. */
static size_t memory_now(void)
{
    unsigned long pages = 0;
    FILE *file = fopen("/proc/self/statm", "re");

    if (!file)
        return 0;
    if (fscanf(file, "%*u %*u %*u %*u %*u %lu", &pages) != 1)
        pages = 0;
    fclose(file);
    return (size_t)pages * (size_t)sysconf(_SC_PAGESIZE);
}

static void go_first(void)
{
    const int file = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);

    if (file < 0)
        return;
    if (write(file, "1000", 4) != 4) /* then it is as likely to go as others */
        (void)file;
    close(file);
}

void lumi_preview_humble(size_t memory_bytes)
{
    const struct sched_param idle = {0};
    const size_t now = memory_now();
    struct rlimit limit;

    setpriority(PRIO_PROCESS, 0, 19);
    sched_setscheduler(0, SCHED_IDLE, &idle);
    syscall(SYS_ioprio_set, 1, 0, 3 << 13); /* ioprio_set(2): this process, class idle */
    go_first();
    if (now > 0 && getrlimit(RLIMIT_DATA, &limit) == 0) {
        const rlim_t wanted = (rlim_t)(now + memory_bytes);
        limit.rlim_cur = limit.rlim_max == RLIM_INFINITY || wanted < limit.rlim_max ? wanted : limit.rlim_max;
        setrlimit(RLIMIT_DATA, &limit);
    }
}
