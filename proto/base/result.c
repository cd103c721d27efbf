/* Result codes and error text. */
#include "proto/base/result.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Names and messages that come from files may hold anything; an error is one line all the same. */
static void keep_one_line(char *text)
{
    for (; *text; text++)
        if ((unsigned char)*text < ' ' || *text == 0x7f)
            *text = '?';
}

int lumi_fail(struct lumi_error *error, int code, const char *format, ...)
{
    if (error) {
        va_list args;
        va_start(args, format);
        error->code = code;
        vsnprintf(error->text, sizeof error->text, format, args);
        va_end(args);
        keep_one_line(error->text);
    }
    return code;
}

int lumi_fail_prefix(struct lumi_error *error, const char *format, ...)
{
    char text[sizeof error->text];
    va_list args;
    int used;

    if (!error)
        return LUMI_ERR_INTERNAL;
    va_start(args, format);
    used = vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (used >= 0 && (size_t)used < sizeof text)
        snprintf(text + used, sizeof text - (size_t)used, ": %.*s", (int)(sizeof text - (size_t)used - 3), error->text);
    memcpy(error->text, text, sizeof text);
    keep_one_line(error->text);
    return error->code;
}

int lumi_fail_errno(struct lumi_error *error, const char *path, const char *doing)
{
    int number = errno;
    int code = LUMI_ERR_IO;

    if (number == ENOSPC || number == EDQUOT)
        code = LUMI_ERR_NOSPACE;
    else if (number == ENOENT || number == ENOTDIR)
        code = LUMI_ERR_NOTFOUND;
    else if (number == EEXIST)
        code = LUMI_ERR_EXISTS;
    else if (number == ENOMEM)
        code = LUMI_ERR_NOMEM;
    return lumi_fail(error, code, "%s: %s: %s", path, doing, strerror(number));
}

int lumi_exit_status(int code)
{
    if (code == LUMI_OK)
        return 0;
    if (code <= LUMI_ERR_FORMAT)
        return 3;
    if (code == LUMI_ERR_ARG)
        return 2;
    return 1;
}
