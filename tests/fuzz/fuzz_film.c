/* Videos: what opens has pictures of one size at rising times or none, and damage is said in a line. */
#include "checks.h"

#include "pipeline/exchange/film.h"

#include <glib.h>
#include <math.h>

#define PICTURES 12      /* decoded of one input */
#define PIXELS_MAX 65536 /* larger ones are only slow */

static void read_sound(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_film *film;
    float *values = NULL;
    int count = 0;

    if (checked(lumi_film_open_memory(data, size, "fuzz", &film, &error), &error) != LUMI_OK)
        return;
    if (checked(lumi_film_sound(film, 100, &values, &count, &error), &error) == LUMI_OK &&
        (count > 0) != (values != NULL))
        abort();
    for (int i = 0; i < count; i++)
        if (!(values[i] >= 0 && values[i] <= 4))
            abort();
    g_free(values);
    lumi_film_close(film);
}

static void read_film(const uint8_t *data, size_t size)
{
    struct lumi_film_picture picture;
    struct lumi_error error = {0};
    struct lumi_raster raster;
    struct lumi_film *film;
    float blocks[12];
    bool there = true;

    if (checked(lumi_film_open_memory(data, size, "fuzz", &film, &error), &error) != LUMI_OK) {
        if (film)
            abort();
        return;
    }
    const struct lumi_film_info *info = lumi_film_info(film);
    if (info->width < 2 || info->height < 2 || info->rotation < 0 || info->rotation >= 360 || !(info->duration >= 0))
        abort();
    there = (uint64_t)info->width * (uint64_t)info->height <= PIXELS_MAX;
    for (int i = 0; there && i < PICTURES; i++) {
        if (checked(lumi_film_next(film, &picture, &there, &error), &error) != LUMI_OK)
            break;
        if (there && !isfinite(picture.time))
            abort();
        if (there && checked(lumi_film_blocks(film, 4, 3, blocks, &error), &error) == LUMI_OK &&
            !(blocks[0] >= 0 && blocks[11] <= 1))
            abort();
        if (there && checked(lumi_film_raster(film, &raster, &error), &error) == LUMI_OK) {
            if (raster.width != info->width || raster.height != info->height || raster.channels != 3)
                abort();
            lumi_raster_finish(&raster);
        }
    }
    const char *damage = lumi_film_damage(film);
    if (damage && (!damage[0] || strchr(damage, '\n')))
        abort();
    bool sound = info->sound && size < 65536;
    lumi_film_close(film);
    if (sound)
        read_sound(data, size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_film);
    return 0;
}
