/* From the work directory to where the user wants it. */
#include "pipeline/graph/deliver.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

enum { BLOCK = 1 << 20 };

static int copy(int in, int out, const char *from, const char *to, struct lumi_error *error)
{
    char *block = lumi_alloc(BLOCK, 1);
    int code = LUMI_OK;

    if (!block)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", to);
    for (;;) {
        ssize_t count = read(in, block, BLOCK);
        if (count < 0 && errno == EINTR)
            continue;
        if (count < 0)
            code = lumi_fail_errno(error, from, "read");
        if (count <= 0)
            break;
        if (lumi_write_all(out, block, (size_t)count)) {
            code = lumi_fail_errno(error, to, "write");
            break;
        }
    }
    lumi_free(block);
    return code;
}

int lumi_deliver(const char *from, const char *to, struct lumi_error *error)
{
    int in = open(from, O_RDONLY | O_CLOEXEC);
    struct lumi_new_file out;

    if (in < 0)
        return lumi_fail_errno(error, from, "open");
    int code = lumi_new_file_open(&out, to, error);
    if (code == LUMI_OK) {
        code = copy(in, out.fd, from, to, error);
        code = lumi_new_file_close(&out, code, true, error);
    }
    close(in);
    return code;
}
