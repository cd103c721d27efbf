/* Drawing a view's triangles into one block of pixels: which surface each ray meets, and how far away. */
#ifndef LUMI_RENDER_CPU_RASTER_BLOCK_H
#define LUMI_RENDER_CPU_RASTER_BLOCK_H

#include "render/cpu/view_surface.h"

/* What a pixel remembers of the triangle it shows. */
struct lumi_triangle_record {
    int tile;
    float gx, gy; /* slope of inverse depth over the view's tangents (1/m) */
};

/* Scratch of one thread. */
struct lumi_block_buffer {
    float nearness[LUMI_BLOCK_PIXELS]; /* inverse distance of what is met, −1: nothing */
    int record[LUMI_BLOCK_PIXELS];
    struct lumi_triangle_record *records;
    int record_count, record_capacity;
};

/* A triangle as half-spaces of directions: e is inside where all three edges are above their thresholds; its inverse
 * distance along e is depth · e. */
struct lumi_triangle {
    float edge[3][3], threshold[3], length[3];
    float depth[3];
};

/* False for one that faces away or has no extent. */
bool lumi_triangle_init(struct lumi_triangle *triangle, const struct lumi_surface_vertex *a,
                        const struct lumi_surface_vertex *b, const struct lumi_surface_vertex *c);

void lumi_block_clear(struct lumi_block_buffer *buffer);
/* Draws one patch, nearest first kept; `missing` tiles are left out. LUMI_ERR_NOMEM. */
int lumi_block_draw(struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                    const struct lumi_surface_view *surface, const struct lumi_patch *patch);
/* The same for one triangle of a patch over an empty buffer (no depth test); returns whether anything was drawn, or
 * LUMI_ERR_NOMEM. */
int lumi_block_draw_one(struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                        const struct lumi_surface_view *surface, const struct lumi_patch *patch, int triangle);
void lumi_block_finish(struct lumi_block_buffer *buffer);

#endif
