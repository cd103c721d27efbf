/* What stays in a camera's pictures while the rig turns, and the ".masks" file that says so. */
#ifndef LUMI_PIPELINE_CALIBRATE_MASK_FIND_H
#define LUMI_PIPELINE_CALIBRATE_MASK_FIND_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* A camera's mask, in blocks of pixels. */
struct lumi_mask {
    int camera;        /* number in the capture */
    int width, height; /* of the picture */
    int block;         /* pixels along the side of one */
    uint8_t *rig;      /* owned; across × down blocks, row by row: 1 the rig */
};
int lumi_mask_across(const struct lumi_mask *mask);
int lumi_mask_down(const struct lumi_mask *mask);

struct lumi_masks {
    int count;
    struct lumi_mask *items; /* owned */
};
void lumi_masks_finish(struct lumi_masks *masks);
int lumi_masks_read(const char *path, struct lumi_masks *masks, struct lumi_error *error);
int lumi_masks_decode(const void *data, size_t size, const char *name, struct lumi_masks *masks,
                      struct lumi_error *error);
int lumi_masks_write(const char *path, const struct lumi_masks *masks, struct lumi_error *error);

/* `count` small pictures (grey, 0..255, width × height) of one camera at different headings. What hardly changes from
 * one to the other is part of the rig if its outline stands out against what is behind it: a plain ceiling hardly
 * changes either, but goes on beyond wherever it is the same by chance. rig: 1 there, and a block around. Returns how
 * many blocks that is; −1: no memory. */
int lumi_mask_find(const float *const *pictures, int count, int width, int height, uint8_t *rig);

#endif
