/* Depth and meshes of a view, for other programs. */
#include "pipeline/exchange/view_export.h"

#include "pipeline/exchange/ply.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/lightfield/mesh_raster.h"

#include <string.h>

int lumi_export_depth(const char *path, const struct lumi_raster *inverse_depth, struct lumi_error *error)
{
    struct lumi_image_options options;
    struct lumi_raster depth;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = false;
    options.channel = "Z";
    options.sync = true;
    int code = lumi_raster_create(&depth, inverse_depth->width, inverse_depth->height, 1, LUMI_F32);
    if (code != LUMI_OK)
        return lumi_fail(error, code, "%s: no memory to write it", path);
    for (int y = 0; y < depth.height; y++)
        for (int x = 0; x < depth.width; x++) {
            float w = lumi_row_f32(inverse_depth, y)[x];
            lumi_row_f32(&depth, y)[x] = w <= 0 ? INFINITY : 1 / w;
        }
    code = lumi_image_write(path, &depth, &options, error);
    lumi_raster_finish(&depth);
    return code;
}

/* What lumi_export_mesh hands to the writer. */
struct arrays {
    float *positions, *texture;
    uint8_t *colours;
    uint32_t *indices;
};

static void place_vertex(const struct lumi_grid *grid, const struct lumi_pose *pose, const struct lumi_raster *image,
                         struct lumi_mesh_point c, double far_m, const struct arrays *arrays, size_t at)
{
    double tan_x, tan_y;

    lumi_grid_unproject(grid, c.x, c.y, &tan_x, &tan_y);
    double z = c.w * far_m > 1 ? 1 / c.w : far_m;
    struct lumi_vec3 world = lumi_to_world(pose, lumi_vec3(tan_x * z, tan_y * z, z));
    arrays->positions[3 * at] = (float)world.x;
    arrays->positions[3 * at + 1] = (float)world.y;
    arrays->positions[3 * at + 2] = (float)world.z;
    arrays->texture[2 * at] = (float)(c.x / grid->width);
    arrays->texture[2 * at + 1] = (float)(c.y / grid->height);
    if (image) {
        int x = c.x >= image->width ? image->width - 1 : (int)c.x;
        int y = c.y >= image->height ? image->height - 1 : (int)c.y;
        memcpy(arrays->colours + 3 * at, lumi_row_u8(image, y) + 3 * x, 3);
    }
}

static void gather(const struct lumi_grid *grid, const struct lumi_pose *pose, const struct lumi_view_mesh *mesh,
                   const struct lumi_raster *image, double far_m, const struct arrays *arrays)
{
    size_t vertex = 0, index = 0;

    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        for (int t = 0; t < 3 * tile->triangle_count; t++)
            arrays->indices[index++] = (uint32_t)(vertex + tile->indices[t]);
        for (int v = 0; v < tile->vertex_count; v++)
            place_vertex(grid, pose, image, lumi_mesh_point(mesh, i, &tile->vertices[v]), far_m, arrays, vertex++);
    }
}

int lumi_export_mesh(const char *path, const struct lumi_grid *grid, const struct lumi_pose *pose,
                     const struct lumi_view_mesh *mesh, const struct lumi_raster *image, double far_m,
                     struct lumi_error *error)
{
    struct lumi_ply ply = {.comment = "world coordinates in metres, +Z up; s, t from the image's top left"};
    int code;

    if (image && (image->sample != LUMI_U8 || image->channels != 3 || image->width != grid->width ||
                  image->height != grid->height))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: the image does not belong to the mesh", path);
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        ply.vertex_count += mesh->tiles[i].vertex_count;
        ply.triangle_count += mesh->tiles[i].triangle_count;
    }
    struct arrays arrays = {
        lumi_alloc(ply.vertex_count, 3 * sizeof(float)), lumi_alloc(ply.vertex_count, 2 * sizeof(float)),
        image ? lumi_alloc(ply.vertex_count, 3) : NULL, lumi_alloc(ply.triangle_count, 3 * sizeof(uint32_t))};
    if (!arrays.positions || !arrays.texture || (image && !arrays.colours) || !arrays.indices) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory to write it", path);
        goto out;
    }
    gather(grid, pose, mesh, image, far_m, &arrays);
    ply.positions = arrays.positions;
    ply.texture = arrays.texture;
    ply.colours = arrays.colours;
    ply.indices = arrays.indices;
    code = lumi_ply_write(path, &ply, error);
out:
    lumi_free(arrays.positions);
    lumi_free(arrays.texture);
    lumi_free(arrays.colours);
    lumi_free(arrays.indices);
    return code;
}
