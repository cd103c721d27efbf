/* Makers' raw files and DNG through LibRaw: black level and white balance as the camera wrote them, demosaiced, linear
 * sRGB primaries; 1 is the sensor's white. Nothing depends on what else is in the picture, so that frames of one camera
 * stay comparable: no automatic brightness, no automatic white balance. */
#define _DEFAULT_SOURCE /* timegm */

#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <string.h>
#include <time.h>

#include <libraw/libraw.h>

#define RAW_MEMORY_MB 2048
#define RAW_RATIO 64   /* pixels of the sensor a byte of the file, at most */
#define DEMOSAIC_AHD 3 /* Hirakawa and Parks, "Adaptive homogeneity-directed demosaicing algorithm", 2005 */

static unsigned get16(const uint8_t *p, bool big)
{
    return big ? (unsigned)(p[0] << 8 | p[1]) : (unsigned)(p[1] << 8 | p[0]);
}

static uint32_t get32(const uint8_t *p, bool big)
{
    return big ? (uint32_t)get16(p, big) << 16 | get16(p + 2, big) : (uint32_t)get16(p + 2, big) << 16 | get16(p, big);
}

/* A TIFF whose first directory says that it is a DNG, or looks like one of a maker's: it names the maker, and the
 * picture there is a preview, a mosaic or compressed in a way of the maker's. */
static bool probe_directory(const uint8_t *data, size_t size)
{
    bool big = data[0] == 'M', maker = false, sign = false;
    uint32_t at = get32(data + 4, big);

    if (at > size || size - at < 2)
        return false;
    unsigned count = get16(data + at, big);
    for (size_t entry = (size_t)at + 2; count > 0 && entry + 12 <= size; entry += 12, count--) {
        unsigned tag = get16(data + entry, big), value = get16(data + entry + 8, big);
        if (tag == 50706) /* DNGVersion */
            return true;
        maker = maker || tag == 271;
        if (tag == 330 || (tag == 254 && get32(data + entry + 8, big) & 1) || (tag == 262 && value == 32803) ||
            (tag == 259 && (value == 32767 || value == 32770 || value == 34713 || value == 65535)))
            sign = true;
    }
    return maker && sign;
}

static bool probe_raw(const uint8_t *data, size_t size)
{
    static const struct {
        unsigned at, length;
        const char *bytes;
    } marks[] = {
        {0, 4, "IIRO"},     {0, 4, "IIRS"},   {0, 4, "MMOR"},    /* Olympus */
        {0, 4, "IIU\0"},                                         /* Panasonic */
        {0, 8, "FUJIFILM"},                                      /* Fujifilm */
        {6, 8, "HEAPCCDR"}, {8, 4, "CR\2\0"}, {4, 7, "ftypcrx"}, /* Canon */
        {0, 4, "\0MRM"},                                         /* Minolta */
    };

    if (size < 16)
        return false;
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++)
        if (!memcmp(data + marks[i].at, marks[i].bytes, marks[i].length))
            return true;
    return (!memcmp(data, "II*\0", 4) || !memcmp(data, "MM\0*", 4)) && probe_directory(data, size);
}

/* What LibRaw tells of damage while it goes on. */
static void on_damage(void *user, const char *file, const int offset)
{
    bool *damaged = user;

    (void)file;
    (void)offset;
    *damaged = true;
}

/* LibRaw 0.21 tells of memory that it does not get by its results alone. */
#if LIBRAW_MAJOR_VERSION > 0 || LIBRAW_MINOR_VERSION >= 21
#define RAW_OPTIONS LIBRAW_OPIONS_NO_DATAERR_CALLBACK
#else
#define RAW_OPTIONS (LIBRAW_OPIONS_NO_MEMERR_CALLBACK | LIBRAW_OPIONS_NO_DATAERR_CALLBACK)
static void on_no_memory(void *user, const char *file, const char *where)
{
    (void)user;
    (void)file;
    (void)where;
}
#endif

static int fail_raw(const struct image_source *source, int code)
{
    switch (code) {
    case LIBRAW_UNSUFFICIENT_MEMORY:
        return lumi_fail(source->error, LUMI_ERR_NOMEM, "%s: no memory for a raw picture", source->name);
    case LIBRAW_TOO_BIG:
        return lumi_fail(source->error, LUMI_ERR_LIMIT, "%s: a raw picture larger than this program accepts",
                         source->name);
    case LIBRAW_FILE_UNSUPPORTED:
    case LIBRAW_NOT_IMPLEMENTED:
        return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED, "%s: a raw file of a kind that cannot be read",
                         source->name);
    default:
        return lumi_fail(source->error, LUMI_ERR_FORMAT, "%s: a damaged raw file (%s)", source->name,
                         libraw_strerror(code));
    }
}

/* LibRaw reads the camera's clock as local time; this takes that back. */
static int64_t camera_time(time_t timestamp)
{
    struct tm fields = {0};

    if (timestamp <= 0 || !localtime_r(&timestamp, &fields))
        return 0;
    fields.tm_isdst = 0;
    return (int64_t)timegm(&fields) * 1000000;
}

/* About green. */
static void take_white(const float multipliers[4], double white[3])
{
    for (int c = 0; c < 3; c++)
        if (!(multipliers[c] > 0 && multipliers[c] < 1e6f))
            return;
    for (int c = 0; c < 3; c++)
        white[c] = (double)multipliers[c] / (double)multipliers[1];
}

static int describe(const struct image_source *source, const libraw_data_t *raw, struct lumi_image_meta *meta)
{
    int channels = raw->idata.colors == 1 ? 1 : 3;
    int flip = raw->sizes.flip;

    if (raw->idata.colors != 1 && raw->idata.colors != 3 && raw->idata.colors != 4)
        return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED, "%s: a raw picture of %d colours", source->name,
                         raw->idata.colors);
    if ((uint64_t)raw->sizes.raw_width * raw->sizes.raw_height > LUMI_IMAGE_MAX_PIXELS)
        return lumi_fail(source->error, LUMI_ERR_LIMIT, "%s: a raw picture larger than this program accepts",
                         source->name);
    if ((uint64_t)raw->sizes.raw_width * raw->sizes.raw_height / RAW_RATIO > source->file_size)
        return lumi_fail(source->error, LUMI_ERR_FORMAT, "%s: claims %dx%d pixels, but has only %llu bytes",
                         source->name, raw->sizes.raw_width, raw->sizes.raw_height,
                         (unsigned long long)source->file_size);
    LUMI_TRY(image_describe(source, raw->sizes.width, raw->sizes.height, channels, LUMI_F32, &meta->info));
    meta->info.orientation = flip == 3 ? 3 : flip == 5 ? 8 : flip == 6 ? 6 : 1;
    if (!memcmp(source->data, "II*\0", 4) || !memcmp(source->data, "MM\0*", 4))
        image_scan_exif(source->data, source->size, meta);
    if (!(meta->exposure_s > 0) && raw->other.shutter > 0)
        meta->exposure_s = (double)raw->other.shutter;
    if (!(meta->iso > 0) && raw->other.iso_speed > 0)
        meta->iso = (double)raw->other.iso_speed;
    if (meta->taken_us == 0)
        meta->taken_us = camera_time(raw->other.timestamp);
    if (!meta->serial[0])
        memcpy(meta->serial, raw->shootinginfo.BodySerial, sizeof meta->serial - 1);
    if (!meta->model[0])
        memcpy(meta->model, raw->idata.model, sizeof meta->model - 1);
    take_white(raw->color.cam_mul, meta->white);
    take_white(raw->color.pre_mul, meta->daylight);
    meta->info.format = LUMI_IMAGE_RAW;
    return LUMI_OK;
}

static void set_white(libraw_output_params_t *out, const struct lumi_image_development *development)
{
    if (!development || (!development->automatic && !(development->white[1] > 0)))
        return;
    out->use_camera_wb = 0;
    out->use_auto_wb = development->automatic ? 1 : 0;
    for (int c = 0; !development->automatic && c < 4; c++) /* two greens */
        out->user_mul[c] = (float)(development->white[c == 3 ? 1 : c] / development->white[1]);
}

static void set_up(libraw_data_t *raw, const struct lumi_image_development *development)
{
    libraw_output_params_t *out = &raw->params;

    out->output_bps = 16;
    out->gamm[0] = out->gamm[1] = 1;
    out->output_color = 1; /* sRGB primaries */
    out->no_auto_bright = 1;
    out->adjust_maximum_thr = 0; /* white is the sensor's, not the brightest pixel's */
    out->use_auto_wb = 0;
    out->use_camera_wb = 1;
    out->user_qual = DEMOSAIC_AHD;
    out->user_flip = 0;
    out->use_fuji_rotate = 0;
    set_white(out, development);
}

static int take_pixels(const struct image_source *source, const libraw_processed_image_t *image,
                       struct lumi_raster *raster)
{
    if (image->type != LIBRAW_IMAGE_BITMAP || image->bits != 16 || image->width != raster->width ||
        image->height != raster->height || image->colors != raster->channels)
        return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED,
                         "%s: a raw picture that comes out as %dx%d pixels of %d colours", source->name, image->width,
                         image->height, image->colors);
    const uint8_t *in = image->data;
    int samples = raster->width * raster->channels;
    for (int y = 0; y < raster->height; y++) {
        float *out = lumi_row_f32(raster, y);
        for (int i = 0; i < samples; i++, in += 2) {
            uint16_t value;
            memcpy(&value, in, 2);
            out[i] = (float)value / 65535;
        }
    }
    return LUMI_OK;
}

static int develop(const struct image_source *source, libraw_data_t *raw, const bool *damaged,
                   struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    libraw_processed_image_t *image = NULL;
    int code;

    set_up(raw, source->development);
    code = libraw_unpack(raw);
    if (code == LIBRAW_SUCCESS && *damaged)
        code = LIBRAW_DATA_ERROR;
    if (code == LIBRAW_SUCCESS)
        code = libraw_dcraw_process(raw);
    if (code == LIBRAW_SUCCESS && source->development && source->development->automatic)
        take_white(raw->color.pre_mul, meta->white);
    if (code == LIBRAW_SUCCESS)
        image = libraw_dcraw_make_mem_image(raw, &code);
    int result = code == LIBRAW_SUCCESS && image ? take_pixels(source, image, raster) : fail_raw(source, code);
    libraw_dcraw_clear_mem(image);
    return result;
}

static int read_raw(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    bool damaged = false;
    libraw_data_t *raw = libraw_init(RAW_OPTIONS);

    if (!raw)
        return lumi_fail(source->error, LUMI_ERR_NOMEM, "%s: no memory for a raw picture", source->name);
    libraw_set_dataerror_handler(raw, on_damage, &damaged);
#if LIBRAW_MAJOR_VERSION > 0 || LIBRAW_MINOR_VERSION >= 21
    raw->rawparams.max_raw_memory_mb = RAW_MEMORY_MB;
#else
    libraw_set_memerror_handler(raw, on_no_memory, NULL);
    raw->params.max_raw_memory_mb = RAW_MEMORY_MB;
#endif
    int code = libraw_open_buffer(raw, (void *)(uintptr_t)source->data, source->size);
    if (code == LIBRAW_FILE_UNSUPPORTED && image_tiff.probe(source->data, source->size)) {
        libraw_close(raw); /* a TIFF that only looked like a raw file */
        meta->info.format = LUMI_IMAGE_TIFF;
        return image_tiff.read(source, raster, meta);
    }
    if (code != LIBRAW_SUCCESS)
        code = fail_raw(source, code);
    else
        code = describe(source, raw, meta);
    if (code == LUMI_OK && raster)
        code = image_claim(source, &meta->info, raster);
    if (code == LUMI_OK && raster)
        code = develop(source, raw, &damaged, raster, meta);
    libraw_close(raw);
    return code;
}

const struct image_codec image_raw = {probe_raw, read_raw, NULL};
