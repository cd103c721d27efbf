/* One white balance for all raw files of a capture: views of different cameras and moments have to be of one colour. */
#include "pipeline/exchange/ingest_priv.h"

#include "proto/base/parallel.h"
#include "proto/base/sort.h"

#include <math.h>
#include <string.h>

#define SAMPLES 24 /* raw files that are developed to find a balance by their content */

static GArray *raw_files(const struct ingest *ingest)
{
    GArray *files = g_array_new(FALSE, FALSE, sizeof(struct lumi_card_file *));

    for (int c = 0; c < ingest->camera_count; c++)
        for (int s = 0; ingest->cameras[c].path && s < ingest->shots.shots; s++) {
            struct lumi_card_file *file;
            if (ingest->cameras[c].frames[s].file < 0)
                continue;
            file = lumi_card_file(&ingest->cameras[c].card, ingest->cameras[c].frames[s].file);
            if (file->meta.info.format == LUMI_IMAGE_RAW)
                g_array_append_val(files, file);
        }
    return files;
}

static bool median(const double (*whites)[3], int count, double white[3])
{
    g_autoptr(GArray) values = g_array_new(FALSE, FALSE, sizeof(double));

    for (int c = 0; c < 3; c++) {
        g_array_set_size(values, 0);
        for (int i = 0; i < count; i++)
            if (whites[i][1] > 0)
                g_array_append_val(values, whites[i][c]);
        white[c] = lumi_sort_median((double *)(void *)values->data, (int)values->len);
    }
    return values->len > 0;
}

struct sampling {
    const GArray *files;
    int stride;
    double (*whites)[3];
};

static int sample_one(void *context, int index, int thread)
{
    const struct lumi_image_development development = {.automatic = true};
    struct sampling *sampling = context;
    struct lumi_image_meta meta;
    struct lumi_raster raster;
    const char *path = g_array_index(sampling->files, struct lumi_card_file *, index * sampling->stride)->path;

    (void)thread;
    LUMI_TRY(lumi_image_read_developed(path, 0, &development, &raster, &meta, NULL));
    memcpy(sampling->whites[index], meta.white, sizeof meta.white);
    lumi_raster_finish(&raster);
    lumi_image_meta_finish(&meta);
    return LUMI_OK;
}

int ingest_find_white(struct ingest *ingest, struct lumi_error *error)
{
    g_autoptr(GArray) files = raw_files(ingest);
    int count = (int)files->len, stride = 1 + (count - 1) / SAMPLES;
    bool found = true;

    memset(ingest->white, 0, sizeof ingest->white);
    if (count == 0)
        return LUMI_OK;
    g_autofree double(*whites)[3] = g_malloc0_n((gsize)count, sizeof *whites);
    switch (ingest->options->white) {
    case LUMI_INGEST_WHITE_GIVEN:
        memcpy(ingest->white, ingest->options->white_given, sizeof ingest->white);
        break;
    case LUMI_INGEST_WHITE_AUTO: {
        struct sampling sampling = {files, stride, whites};
        int samples = (count + stride - 1) / stride;
        lumi_parallel_for(samples, ingest->options->threads, sample_one, &sampling);
        found = median((const double(*)[3])whites, samples, ingest->white);
        break;
    }
    default:
        for (int i = 0; i < count; i++) {
            const struct lumi_image_meta *meta = &g_array_index(files, struct lumi_card_file *, i)->meta;
            memcpy(whites[i], ingest->options->white == LUMI_INGEST_WHITE_DAYLIGHT ? meta->daylight : meta->white,
                   sizeof *whites);
        }
        found = median((const double(*)[3])whites, count, ingest->white);
    }
    if (!found && ingest->options->white == LUMI_INGEST_WHITE_CAMERA)
        ingest->white[0] = ingest->white[1] = ingest->white[2] = 1; /* sensors that say nothing: as they are */
    else if (!found)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "%s: raw files that do not tell their white balance: --white-balance R,G,B says it",
                         g_array_index(files, struct lumi_card_file *, 0)->path);
    return LUMI_OK;
}
