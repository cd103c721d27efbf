/* Whole files: read into memory, written under a temporary name and renamed. */
#ifndef LUMI_PROTO_BASE_FILE_H
#define LUMI_PROTO_BASE_FILE_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a regular file of at most `limit` bytes (LUMI_ERR_LIMIT if it is larger). *data is released with lumi_free; a
 * zero byte stands after its end, so that text can be parsed in place. */
int lumi_file_read(const char *path, size_t limit, uint8_t **data, size_t *size, struct lumi_error *error);

/* write(2) until all is written. −1 with errno set where that cannot be. */
int lumi_write_all(int fd, const void *data, size_t size);

/* A file that appears under its name when it is whole: written as "<path>.tmp-<process>-<count>", which is locked
 * (flock) until then. */
struct lumi_new_file {
    char *path, *temporary;
    int fd; /* to be written to */
};
/* Also removes what processes that were killed have left of earlier files of this name. LUMI_ERR_ARG where its folder
 * is not there. */
int lumi_new_file_open(struct lumi_new_file *file, const char *path, struct lumi_error *error);
/* `code` LUMI_OK: renames it; otherwise removes it. `sync`: its bytes and its folder reach the disk before this
 * returns. Returns `code`, or why it could not be kept. */
int lumi_new_file_close(struct lumi_new_file *file, int code, bool sync, struct lumi_error *error);

/* Makes or replaces a file: whole or not at all. `sync`: its bytes and its folder reach the disk before this returns.
 */
int lumi_file_write(const char *path, const void *data, size_t size, bool sync, struct lumi_error *error);

/* Whether a file could be made or replaced at `path`, asked before hours of work: LUMI_ERR_ARG where that is a folder
 * or in a folder that is not there, LUMI_ERR_IO where nothing can be written. */
int lumi_file_check_place(const char *path, struct lumi_error *error);

/* LUMI_ERR_ARG where a file at `path` (there already or not) would take the place of `input`, or of a part of it: it is
 * that file, or lies in that folder. */
int lumi_file_check_output(const char *path, const char *input, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
