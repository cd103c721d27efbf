/* Pixels at rest: JPEG (8 bit), PNG (8, 16 bit), TIFF (8, 16 bit, float) and OpenEXR (half, float), to and from
 * rasters; DNG and makers' raw files from them.
 *
 * 1. What a file is is told by its first bytes, never by its name.
 * 2. U8 and U16 rasters are sRGB-encoded, F32 ones linear light: JPEG and integer PNG and TIFF read as the former,
 *    OpenEXR, floating-point TIFF and raw files as the latter: these are developed with the black level and the white
 *    balance they carry, nothing depends on the picture, 1 is the sensor's white. Embedded colour profiles are not
 *    applied.
 * 3. Anything a library complains about is an error, warnings such as "premature end of JPEG data" included: one line
 *    that names the file, and no pixels. Nothing is printed.
 * 4. Memory is bounded before it is asked for: no side over LUMI_RASTER_MAX, at most LUMI_IMAGE_MAX_PIXELS pixels, and
 *    no more pixels than LUMI_IMAGE_MAX_RATIO times the file's bytes can hold.
 * 5. Files appear whole or not at all: they are written under a temporary name in the same folder and renamed.
 * 6. The orientation an image carries (EXIF, TIFF) is reported, not applied: lenses and poses speak of the pixels as
 *    they lie in the file. */
#ifndef LUMI_PROTO_IMAGE_IMAGE_H
#define LUMI_PROTO_IMAGE_IMAGE_H

#include "proto/base/raster.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_IMAGE_MAX_PIXELS ((uint64_t)1 << 28)
#define LUMI_IMAGE_MAX_RATIO 16384

enum lumi_image_format {
    LUMI_IMAGE_AUTO = 0, /* writing: by the path's extension */
    LUMI_IMAGE_JPEG = 1,
    LUMI_IMAGE_PNG = 2,
    LUMI_IMAGE_TIFF = 3,
    LUMI_IMAGE_EXR = 4,
    LUMI_IMAGE_RAW = 5 /* read only */
};

/* What a file holds, from its header alone. */
struct lumi_image_info {
    enum lumi_image_format format;
    int width, height;
    int channels;            /* as read with channels = 0: 1, 3 or 4 */
    enum lumi_sample sample; /* as read */
    int orientation;         /* EXIF's and TIFF's 1..8; 1 where nothing is said */
};

struct lumi_image_meta {
    struct lumi_image_info info;
    uint8_t *exif; /* the EXIF block, beginning with its TIFF header ("II" or "MM"); NULL if there is none; owned */
    size_t exif_size;
    double exposure_s; /* from the EXIF block, 0 where it does not say */
    double iso;
    int64_t taken_us; /* Unix time of the exposure; where the file names no time zone, as if the camera's clock showed
                         universal time; 0: it does not say */
    char serial[64], model[64]; /* of the camera's body; "" */
    /* Raw files: what red, green and blue were multiplied with, and what daylight wants of that sensor; green is 1, all
     * 0 where the file does not tell. */
    double white[3], daylight[3];
};

void lumi_image_meta_finish(struct lumi_image_meta *meta);

/* Reads a file. `channels`: 0 as they are in the file (1 grey, 3 RGB, 4 RGB and alpha), 3 for RGB whatever they are
 * (grey copied, alpha dropped). `meta` may be NULL; otherwise release it with lumi_image_meta_finish. On failure both
 * are all zero. CMYK and palettes beyond RGB, tiled or deep OpenEXR parts and the like: LUMI_ERR_UNSUPPORTED. */
int lumi_image_read(const char *path, int channels, struct lumi_raster *raster, struct lumi_image_meta *meta,
                    struct lumi_error *error);
/* How a raw file is developed; other formats do not ask. All zero: as it says itself. */
struct lumi_image_development {
    double white[3]; /* red, green and blue are multiplied with; green 0: the file's own balance */
    bool automatic;  /* instead: so that the picture is grey on the whole; meta->white tells with what */
};
/* As lumi_image_read. */
int lumi_image_read_developed(const char *path, int channels, const struct lumi_image_development *development,
                              struct lumi_raster *raster, struct lumi_image_meta *meta, struct lumi_error *error);
/* The same from memory; `name` stands for the path in errors. */
int lumi_image_read_memory(const void *data, size_t size, const char *name, int channels, struct lumi_raster *raster,
                           struct lumi_image_meta *meta, struct lumi_error *error);

/* The same from memory for a picture to look at, as small as is wanted where that saves work: a JPEG is decoded at an
 * eighth of its size, two eighths …, the most that is not wider than `most`, an eighth at least; other formats are read
 * whole. `info`: the whole image; may be NULL. */
int lumi_image_read_reduced(const void *data, size_t size, const char *name, int most, struct lumi_raster *raster,
                            struct lumi_image_info *info, struct lumi_error *error);

/* The header alone: fast, no pixels are decoded. */
int lumi_image_info(const char *path, struct lumi_image_info *info, struct lumi_error *error);
int lumi_image_info_memory(const void *data, size_t size, const char *name, struct lumi_image_info *info,
                           struct lumi_error *error);

/* The header with the EXIF block (of a PNG only where it stands before the pixels). */
int lumi_image_read_meta(const char *path, struct lumi_image_meta *meta, struct lumi_error *error);

/* One named channel of an OpenEXR file ("Z", "W", "B" ...) as a 1-channel F32 raster. LUMI_ERR_NOTFOUND if it has no
 * such channel. */
int lumi_image_read_channel(const char *path, const char *channel, struct lumi_raster *raster,
                            struct lumi_error *error);

struct lumi_image_options {
    enum lumi_image_format format;
    int quality;         /* JPEG: 1..100 */
    bool subsample;      /* JPEG: 4:2:0 chroma; false: 4:4:4 */
    int bits;            /* PNG, TIFF: 8, 16 (TIFF also 32, float); 0: as the raster; F32 in PNG is 16 */
    bool half;           /* OpenEXR: 16-bit floats; false: 32-bit floats */
    const char *channel; /* OpenEXR: name of a 1-channel raster's channel (NULL: "Y"), or of a 4-channel one's fourth,
                            which then is no colour and has 32 bits (NULL: "A") */
    int level;           /* PNG, OpenEXR, TIFF: deflate level 1..9; 0: a fast choice (OpenEXR: PIZ); −1: none */
    bool sync;           /* fsync before the file gets its name */
    const void *exif;    /* EXIF block to embed (JPEG, PNG), as in lumi_image_meta; may be NULL */
    size_t exif_size;
};

/* quality 95, 4:4:4, half floats, fast compression, no sync. */
void lumi_image_options_init(struct lumi_image_options *options);

/* Writes a raster (`options` may be NULL for the defaults). Samples the format cannot hold are converted as
 * lumi_raster_convert does: JPEG U8; PNG U8, U16; OpenEXR F32. JPEG takes 1 or 3 channels. The bytes depend on the
 * pixels and options alone. */
int lumi_image_write(const char *path, const struct lumi_raster *raster, const struct lumi_image_options *options,
                     struct lumi_error *error);
/* The same into memory: *data is released with lumi_free. options->format must be set. */
int lumi_image_encode(const struct lumi_raster *raster, const struct lumi_image_options *options, uint8_t **data,
                      size_t *size, struct lumi_error *error);

/* "photo.JPG" → LUMI_IMAGE_JPEG; LUMI_IMAGE_AUTO for an extension that is none of ours. */
enum lumi_image_format lumi_image_format_of_name(const char *path);

#ifdef __cplusplus
}
#endif
#endif
