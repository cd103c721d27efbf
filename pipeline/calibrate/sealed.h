/* What the files have in common that calibration's stages leave for one another: eight letters, the number of the
 * format, then the content, and a checksum (CRC-32C) over all before it. */
#ifndef LUMI_PIPELINE_CALIBRATE_SEALED_H
#define LUMI_PIPELINE_CALIBRATE_SEALED_H

#include "proto/base/bytes.h"
#include "proto/base/result.h"

struct lumi_sealed {
    char letters[8];
    uint32_t format;
    const char *what; /* "features": what it holds, for messages */
};

/* Sets `reader` to the content, once letters, format and checksum are right. `name` stands in messages. */
int lumi_sealed_open(const struct lumi_sealed *kind, const void *data, size_t size, const char *name,
                     struct lumi_reader *reader, struct lumi_error *error);
/* Once all of the content has been read: that there was as much as was asked for, and no more. */
int lumi_sealed_end(const struct lumi_sealed *kind, const struct lumi_reader *reader, const char *name,
                    struct lumi_error *error);

/* Begins a file; the content follows. */
void lumi_sealed_begin(const struct lumi_sealed *kind, struct lumi_writer *writer);
/* Ends it and writes it, whole or not at all; finishes the writer. */
int lumi_sealed_save(struct lumi_writer *writer, const char *path, struct lumi_error *error);

#endif
