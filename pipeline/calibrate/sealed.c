/* Letters, format and checksum around the content of a file. */
#include "pipeline/calibrate/sealed.h"

#include "proto/base/file.h"

#include <string.h>

enum { HEAD = 12, SUM = 4 };

int lumi_sealed_open(const struct lumi_sealed *kind, const void *data, size_t size, const char *name,
                     struct lumi_reader *reader, struct lumi_error *error)
{
    struct lumi_reader end;

    lumi_reader_init(reader, data, size);
    const uint8_t *letters = lumi_read_bytes(reader, sizeof kind->letters);
    if (!letters || memcmp(letters, kind->letters, sizeof kind->letters))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is no file of %s", name, kind->what);
    const uint32_t format = lumi_read_u32(reader);
    if (size < HEAD + SUM)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is cut short", name);
    if (format != kind->format)
        return lumi_fail(error, LUMI_ERR_VERSION, "%s: format %u; this build reads %u", name, format, kind->format);
    reader->size -= SUM;
    lumi_reader_init(&end, reader->data + reader->size, SUM);
    if (lumi_read_u32(&end) != lumi_crc32c(0, reader->data, reader->size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is damaged or cut short (checksum)", name);
    return LUMI_OK;
}

int lumi_sealed_end(const struct lumi_sealed *kind, const struct lumi_reader *reader, const char *name,
                    struct lumi_error *error)
{
    if (reader->failed || lumi_reader_left(reader) > 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is shorter or longer than its %s", name, kind->what);
    return LUMI_OK;
}

void lumi_sealed_begin(const struct lumi_sealed *kind, struct lumi_writer *writer)
{
    lumi_writer_init(writer);
    lumi_write_bytes(writer, kind->letters, sizeof kind->letters);
    lumi_write_u32(writer, kind->format);
}

int lumi_sealed_save(struct lumi_writer *writer, const char *path, struct lumi_error *error)
{
    if (!writer->failed)
        lumi_write_u32(writer, lumi_crc32c(0, writer->data, writer->size));
    int code = writer->failed ? lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", path)
                              : lumi_file_write(path, writer->data, writer->size, false, error);
    lumi_writer_finish(writer);
    return code;
}
