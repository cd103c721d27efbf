/* The truth: pictures whose poses and lenses a transforms.json (or another source that can be imported) gives. */
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/exchange/exchange.h"
#include "proto/image/image.h"

#include <glib.h>

/* The size, from the picture itself where the source does not say it. */
static int truth_lens(const struct lumi_exchange *list, const struct lumi_exchange_image *image, struct lumi_lens *lens,
                      struct lumi_error *error)
{
    struct lumi_exchange_camera camera = *lumi_exchange_camera(list, image->camera);

    if (camera.width <= 0 || camera.height <= 0) {
        struct lumi_image_info info;
        LUMI_TRY(lumi_image_info(image->path, &info, error));
        camera.width = info.width;
        camera.height = info.height;
    }
    return lumi_exchange_lens(&camera, image->path, lens, error);
}

static int add_frame(const struct lumi_exchange *list, const struct lumi_exchange_image *image, const GRegex *wanted,
                     struct lumi_truth_set *truth, struct lumi_error *error)
{
    const char *stem = image->name ? image->name : image->original;
    struct lumi_truth *item = &truth->items[truth->count];

    if (wanted && !g_regex_match(wanted, stem, 0, NULL))
        return LUMI_OK;
    LUMI_TRY(truth_lens(list, image, &item->lens, error));
    item->pose = image->pose;
    item->name = g_strdup(stem);
    item->path = g_strdup(image->path);
    truth->count++;
    return LUMI_OK;
}

int lumi_truth_read(const char *path, const char *frames, bool poses_only, struct lumi_truth_set *truth,
                    struct lumi_error *error)
{
    struct lumi_import_options options;
    struct lumi_exchange list;
    g_autoptr(GRegex) wanted = NULL;
    int code = LUMI_OK;

    *truth = (struct lumi_truth_set){0};
    if (frames) {
        g_autoptr(GError) regex_error = NULL;
        wanted = g_regex_new(frames, G_REGEX_ANCHORED, 0, &regex_error);
        if (!wanted)
            return lumi_fail(error, LUMI_ERR_ARG, "--frames %s: %s", frames, regex_error->message);
    }
    lumi_import_options_init(&options);
    options.trust = true;
    options.poses_only = poses_only;
    lumi_exchange_init(&list);
    LUMI_GOTO(code, out, lumi_import_list(path, &options, &list, error));
    truth->items = g_new0(struct lumi_truth, list.images->len);
    for (int i = 0; i < (int)list.images->len && code == LUMI_OK; i++)
        code = add_frame(&list, lumi_exchange_image(&list, i), wanted, truth, error);
    if (code == LUMI_OK && truth->count == 0)
        code = lumi_fail(error, frames ? LUMI_ERR_ARG : LUMI_ERR_FORMAT, "%s: no frames%s%s", path,
                         frames ? " whose names match " : "", frames ? frames : "");
    if (code != LUMI_OK)
        lumi_truth_finish(truth);
out:
    lumi_exchange_finish(&list);
    return code;
}

int lumi_truth_picture(const struct lumi_truth *truth, struct lumi_raster *picture, struct lumi_error *error)
{
    struct lumi_raster raw = {0};

    LUMI_TRY(lumi_image_read(truth->path, 3, &raw, NULL, error));
    if (raw.width != truth->lens.width || raw.height != truth->lens.height) {
        int code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: the picture is %d×%d, its lens %d×%d", truth->path, raw.width,
                             raw.height, truth->lens.width, truth->lens.height);
        lumi_raster_finish(&raw);
        return code;
    }
    if (raw.sample == LUMI_U8) {
        *picture = raw;
        return LUMI_OK;
    }
    int code = lumi_raster_convert(&raw, LUMI_U8, picture);
    lumi_raster_finish(&raw);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "%s: no memory for the picture", truth->path);
}
