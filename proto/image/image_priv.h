/* What the formats share. */
#ifndef LUMI_PROTO_IMAGE_IMAGE_PRIV_H
#define LUMI_PROTO_IMAGE_IMAGE_PRIV_H

#include "proto/base/bytes.h"
#include "proto/image/image.h"

/* A file in memory, or (for headers) its beginning. */
struct image_source {
    const uint8_t *data;
    size_t size;        /* bytes that are here */
    uint64_t file_size; /* bytes there are in all */
    const char *name;
    struct lumi_error *error;
    int most;                                         /* pixels in a row that are wanted; 0: all there are */
    const struct lumi_image_development *development; /* of raw files; NULL: as they say */
};

struct image_codec {
    bool (*probe)(const uint8_t *data, size_t size);
    /* Fills meta->info; and raster and meta->exif unless raster is NULL. On failure the caller releases both. */
    int (*read)(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta);
    /* `raster` has samples the format holds. */
    int (*encode)(const struct lumi_raster *raster, const struct lumi_image_options *options, struct lumi_writer *out,
                  struct lumi_error *error);
};

extern const struct image_codec image_jpeg, image_png, image_tiff, image_exr, image_raw;

/* Fills `info` and checks the limits of image.h. */
int image_describe(const struct image_source *source, uint64_t width, uint64_t height, int channels,
                   enum lumi_sample sample, struct lumi_image_info *info);
/* The raster for an info that passed. */
int image_claim(const struct image_source *source, const struct lumi_image_info *info, struct lumi_raster *raster);

/* One channel of an OpenEXR file in memory. */
int image_exr_channel(const struct image_source *source, const char *channel, struct lumi_raster *raster);

/* Copies an EXIF block into meta and takes from it what meta has fields for, as far as the block makes sense. */
/* As far as it goes, from a TIFF file too; nothing is kept of it. */
void image_scan_exif(const void *exif, size_t size, struct lumi_image_meta *meta);
int image_keep_exif(const struct image_source *source, const void *exif, size_t size, struct lumi_image_meta *meta);

#endif
