/* Triangles as binary PLY. */
#include "pipeline/exchange/ply.h"

#include "proto/base/bytes.h"
#include "proto/base/file.h"

#include <stdio.h>
#include <string.h>

static void write_header(const struct lumi_ply *ply, struct lumi_writer *out)
{
    char text[1024];

    int used = snprintf(text, sizeof text,
                        "ply\nformat binary_little_endian 1.0\n%s%.200s%selement vertex %zu\n"
                        "property float x\nproperty float y\nproperty float z\n%s%s"
                        "element face %zu\nproperty list uchar int vertex_indices\nend_header\n",
                        ply->comment ? "comment " : "", ply->comment ? ply->comment : "", ply->comment ? "\n" : "",
                        ply->vertex_count, ply->texture ? "property float s\nproperty float t\n" : "",
                        ply->colours ? "property uchar red\nproperty uchar green\nproperty uchar blue\n" : "",
                        ply->triangle_count);
    lumi_write_bytes(out, text, (size_t)used);
}

int lumi_ply_write(const char *path, const struct lumi_ply *ply, struct lumi_error *error)
{
    struct lumi_writer out;

    lumi_writer_init(&out);
    write_header(ply, &out);
    for (size_t i = 0; i < ply->vertex_count; i++) {
        for (int k = 0; k < 3; k++)
            lumi_write_f32(&out, ply->positions[3 * i + (size_t)k]);
        for (int k = 0; ply->texture && k < 2; k++)
            lumi_write_f32(&out, ply->texture[2 * i + (size_t)k]);
        if (ply->colours)
            lumi_write_bytes(&out, ply->colours + 3 * i, 3);
    }
    for (size_t i = 0; i < ply->triangle_count; i++) {
        lumi_write_u8(&out, 3);
        for (int k = 0; k < 3; k++)
            lumi_write_u32(&out, ply->indices[3 * i + (size_t)k]);
    }
    int code = out.failed ? lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory to write it", path)
                          : lumi_file_write(path, out.data, out.size, true, error);
    lumi_writer_finish(&out);
    return code;
}
