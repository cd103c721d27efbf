/* Result codes and error text: how every function in the tree says that it failed. */
#ifndef LUMI_PROTO_BASE_RESULT_H
#define LUMI_PROTO_BASE_RESULT_H

#ifdef __cplusplus
extern "C" {
#endif

/* Functions that can fail return 0 or one of these. One meaning a code. */
enum lumi_result {
    LUMI_OK = 0,
    LUMI_ERR_NOMEM = -1,        /* memory could not be had */
    LUMI_ERR_IO = -2,           /* the operating system refused a read or a write */
    LUMI_ERR_NOSPACE = -3,      /* the disk is full */
    LUMI_ERR_BUSY = -4,         /* somebody else holds it */
    LUMI_ERR_CANCELLED = -5,    /* asked to stop */
    LUMI_ERR_INTERNAL = -6,     /* a library did what its documentation excludes */
    LUMI_ERR_ARG = -10,         /* the caller's (on the command line: the user's) argument is wrong */
    LUMI_ERR_FORMAT = -20,      /* input: malformed, truncated, out of range, contradictory */
    LUMI_ERR_VERSION = -21,     /* input: from a newer version of this program */
    LUMI_ERR_UNSUPPORTED = -22, /* input: well-formed, but of a kind this program does not handle */
    LUMI_ERR_CHECKSUM = -23,    /* input: does not match its checksum */
    LUMI_ERR_NOTFOUND = -24,    /* input: a file or a named thing that is not there */
    LUMI_ERR_EXISTS = -25,      /* input: a name that is taken */
    LUMI_ERR_LIMIT = -26        /* input: over a stated limit */
};

/* One line for a person: names the file and what is wrong. Filled only when a function fails. */
struct lumi_error {
    int code;
    char text[1024];
};

/* Formats the text into `error` (may be NULL) and returns `code`, so that a failing function can `return
 * lumi_fail(...)`. */
int lumi_fail(struct lumi_error *error, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

/* Puts "prefix: " before the text that is there and returns error->code (LUMI_ERR_INTERNAL for NULL). */
int lumi_fail_prefix(struct lumi_error *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* From errno: ENOSPC and EDQUOT are LUMI_ERR_NOSPACE, ENOENT LUMI_ERR_NOTFOUND, EEXIST LUMI_ERR_EXISTS, ENOMEM
 * LUMI_ERR_NOMEM, the rest LUMI_ERR_IO. The text is "<path>: <doing>: <strerror>". */
int lumi_fail_errno(struct lumi_error *error, const char *path, const char *doing);

/* The program's exit status for a code: 0 done, 1 the work failed, 2 wrong command line, 3 bad input. */
int lumi_exit_status(int code);

/* Returns from the calling function with the code when `expression` is not LUMI_OK. */
#define LUMI_TRY(expression)                                                                                           \
    do {                                                                                                               \
        int lumi_try_code_ = (expression);                                                                             \
        if (lumi_try_code_ != LUMI_OK)                                                                                 \
            return lumi_try_code_;                                                                                     \
    } while (0)

/* Goes to `label` with `code` set when `expression` is not LUMI_OK. */
#define LUMI_GOTO(code, label, expression)                                                                             \
    do {                                                                                                               \
        (code) = (expression);                                                                                         \
        if ((code) != LUMI_OK)                                                                                         \
            goto label;                                                                                                \
    } while (0)

#ifdef __cplusplus
}
#endif
#endif
