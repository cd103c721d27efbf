/* What an EXIF block is asked for: orientation, exposure time, sensitivity, time, camera (Exif 2.32, sections 4.6.4 and
 * 4.6.5). */
#define _DEFAULT_SOURCE /* timegm */

#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#define TAG_ORIENTATION 0x0112
#define TAG_EXIF_DIRECTORY 0x8769
#define TAG_EXPOSURE_TIME 0x829a
#define TAG_ISO 0x8827
#define TAG_MODEL 0x0110
#define TAG_DATE_TIME_ORIGINAL 0x9003
#define TAG_OFFSET_TIME_ORIGINAL 0x9011
#define TAG_SUBSEC_TIME_ORIGINAL 0x9291
#define TAG_BODY_SERIAL 0xa431
#define TYPE_ASCII 2
#define TYPE_SHORT 3
#define TYPE_LONG 4
#define TYPE_RATIONAL 5

struct tiff {
    const uint8_t *data;
    size_t size;
    bool big;
};

static unsigned get16(const struct tiff *tiff, size_t at)
{
    if (tiff->size < 2 || at > tiff->size - 2)
        return 0;
    const uint8_t *p = tiff->data + at;
    return tiff->big ? (unsigned)(p[0] << 8 | p[1]) : (unsigned)(p[1] << 8 | p[0]);
}

static uint32_t get32(const struct tiff *tiff, size_t at)
{
    uint32_t first = get16(tiff, at), second = get16(tiff, at + 2);

    return tiff->big ? first << 16 | second : second << 16 | first;
}

/* Printable characters of a text, without spaces at its end. */
static void take_text(const struct tiff *tiff, size_t entry, char *text, size_t room)
{
    uint32_t count = get32(tiff, entry + 4);
    size_t at = count <= 4 ? entry + 8 : get32(tiff, entry + 8), length = 0;

    for (; length < count && length + 1 < room && at + length < tiff->size; length++) {
        uint8_t c = tiff->data[at + length];
        if (c == 0)
            break;
        text[length] = c >= 0x20 && c < 0x7f ? (char)c : '?';
    }
    while (length > 0 && text[length - 1] == ' ')
        length--;
    text[length] = '\0';
}

/* What the time is put together from. */
struct texts {
    char time[24], fraction[12], offset[8];
};

static void read_camera(const struct tiff *tiff, size_t entry, bool first, struct lumi_image_meta *meta,
                        struct texts *texts)
{
    if (get16(tiff, entry + 2) != TYPE_ASCII)
        return;
    switch (get16(tiff, entry)) {
    case TAG_MODEL:
        if (first)
            take_text(tiff, entry, meta->model, sizeof meta->model);
        break;
    case TAG_DATE_TIME_ORIGINAL:
        take_text(tiff, entry, texts->time, sizeof texts->time);
        break;
    case TAG_OFFSET_TIME_ORIGINAL:
        take_text(tiff, entry, texts->offset, sizeof texts->offset);
        break;
    case TAG_SUBSEC_TIME_ORIGINAL:
        take_text(tiff, entry, texts->fraction, sizeof texts->fraction);
        break;
    case TAG_BODY_SERIAL:
        take_text(tiff, entry, meta->serial, sizeof meta->serial);
        break;
    default:
        break;
    }
}

/* "2026:11:23 10:25:18", "123", "+02:00" → microseconds; 0 where that is no time. */
static int64_t join_time(const struct texts *texts)
{
    int year, month, day, hour, minute, second, offset_hours = 0, offset_minutes = 0;
    int64_t fraction = 0, unit = 1000000;

    if (sscanf(texts->time, "%4d:%2d:%2d %2d:%2d:%2d", &year, &month, &day, &hour, &minute, &second) != 6)
        return 0;
    if (year < 1970 || year > 9999 || month < 1 || month > 12 || day < 1 || day > 31 || hour < 0 || hour > 23 ||
        minute < 0 || minute > 59 || second < 0 || second > 60)
        return 0;
    for (const char *c = texts->fraction; *c >= '0' && *c <= '9' && unit > 1; c++) {
        unit /= 10;
        fraction += unit * (*c - '0');
    }
    struct tm fields = {.tm_year = year - 1900,
                        .tm_mon = month - 1,
                        .tm_mday = day,
                        .tm_hour = hour,
                        .tm_min = minute,
                        .tm_sec = second};
    int64_t seconds = (int64_t)timegm(&fields);
    const char *sign = texts->offset;
    if ((*sign == '+' || *sign == '-') && sscanf(sign + 1, "%2d:%2d", &offset_hours, &offset_minutes) == 2 &&
        offset_hours >= 0 && offset_hours < 15 && offset_minutes >= 0 && offset_minutes < 60)
        seconds -= (*sign == '-' ? -1 : 1) * (offset_hours * 3600 + offset_minutes * 60);
    return seconds * 1000000 + fraction;
}

/* Where the first directory says that the EXIF directory lies, 0 if it does not. Of several the last one is followed,
 * once: a directory that names itself a thousand times costs no more. */
static uint32_t read_directory(const struct tiff *tiff, size_t directory, bool first, struct lumi_image_meta *meta,
                               struct texts *texts)
{
    unsigned count = get16(tiff, directory);
    uint32_t exif = 0;

    for (unsigned i = 0; i < count; i++) {
        size_t entry = directory + 2 + (size_t)i * 12;
        if (entry + 12 > tiff->size)
            break;
        read_camera(tiff, entry, first, meta, texts);
        unsigned tag = get16(tiff, entry), type = get16(tiff, entry + 2), value = get16(tiff, entry + 8);
        uint32_t at = get32(tiff, entry + 8);
        if (first && tag == TAG_ORIENTATION && type == TYPE_SHORT && value >= 1 && value <= 8)
            meta->info.orientation = (int)value;
        else if (first && tag == TAG_EXIF_DIRECTORY && type == TYPE_LONG)
            exif = at;
        else if (!first && tag == TAG_EXPOSURE_TIME && type == TYPE_RATIONAL && get32(tiff, (size_t)at + 4) != 0)
            meta->exposure_s = (double)get32(tiff, at) / get32(tiff, (size_t)at + 4);
        else if (!first && tag == TAG_ISO && type == TYPE_SHORT)
            meta->iso = value;
    }
    return exif;
}

void image_scan_exif(const void *exif, size_t size, struct lumi_image_meta *meta)
{
    struct tiff tiff = {exif, size, size > 0 && *(const uint8_t *)exif == 'M'};
    struct texts texts = {0};

    if (size < 8 || (memcmp(exif, "II*\0", 4) != 0 && memcmp(exif, "MM\0*", 4) != 0))
        return;
    uint32_t directory = read_directory(&tiff, get32(&tiff, 4), true, meta, &texts);
    if (directory > 0)
        read_directory(&tiff, directory, false, meta, &texts);
    meta->taken_us = join_time(&texts);
}

int image_keep_exif(const struct image_source *source, const void *exif, size_t size, struct lumi_image_meta *meta)
{
    if (size == 0 || meta->exif)
        return LUMI_OK;
    meta->exif = lumi_alloc(size, 1);
    if (!meta->exif)
        return lumi_fail(source->error, LUMI_ERR_NOMEM, "%s: no memory for its EXIF block", source->name);
    memcpy(meta->exif, exif, size);
    meta->exif_size = size;
    image_scan_exif(meta->exif, size, meta);
    return LUMI_OK;
}
