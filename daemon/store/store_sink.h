/* A file being written past the page cache, with its checksum: what comes is gathered into aligned blocks. */
#ifndef LUMI_DAEMON_STORE_STORE_SINK_H
#define LUMI_DAEMON_STORE_STORE_SINK_H

#include "proto/base/result.h"

#include <nettle/sha2.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct store_sink {
    int fd;
    const char *name; /* for error texts; the caller's */
    void *memory;
    uint8_t *block; /* aligned, in memory */
    size_t held;    /* bytes in block */
    int64_t at;     /* bytes in the file */
    bool direct;
    struct sha256_ctx hash;
};

/* A new file in the folder; LUMI_ERR_EXISTS. Where the file system knows no O_DIRECT it is written in the ordinary way.
 */
int store_sink_open(struct store_sink *sink, int folder, const char *name, struct lumi_error *error);
int store_sink_put(struct store_sink *sink, const void *data, size_t size, struct lumi_error *error);
/* The rest of an open file, from where it stands. `yield` (may be NULL) is called before every block. */
int store_sink_put_file(struct store_sink *sink, int fd, const char *path, int (*yield)(void *context), void *context,
                        struct lumi_error *error);
/* `code` LUMI_OK: everything is written and synced; `sha256` has its checksum, *bytes its size. Closes in any case;
 * returns code, or why it could not be kept. The file stays. */
int store_sink_close(struct store_sink *sink, int code, int64_t *bytes, char sha256[65], struct lumi_error *error);

/* The calling thread reads and writes only when nobody else wants the disk, and steps back from the processor. */
void store_be_humble(void);
/* Makes a file of so many bytes that are really there. */
int store_reserve(int folder, const char *name, int64_t bytes);

#endif
