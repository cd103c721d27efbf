/* The local engine: as many images at once as this computer's cores and memory allow. */
#include "pipeline/engine/local.h"

#include <glib.h>

static void (*say_line)(const char *line);

int64_t lumi_engine_image_bytes(const struct lumi_run *run, const struct lumi_stage *stage)
{
    double pixels = (double)run->grid.width * run->grid.height;

    for (int i = 0; i < run->count; i++)
        pixels = MAX(pixels, (double)run->sources[i].lens.width * run->sources[i].lens.height);
    return (int64_t)(pixels * stage->bytes_per_pixel);
}

int lumi_engine_threads(const struct lumi_resources *resources, int64_t image_bytes, int threads)
{
    int count = threads > 0 ? threads : resources->cores;

    if (image_bytes > 0 && resources->memory < INT64_MAX) {
        const int64_t fitting = (resources->memory / 10 * 9) / image_bytes;
        count = fitting < count ? (int)fitting : count;
    }
    return MAX(1, count);
}

/* Asked before a stage with `images` to make; what is left is looked up anew, since others use the computer too. */
static int choose(struct lumi_run *run, const struct lumi_stage *stage, int images)
{
    const int64_t bytes = stage->serial || stage->whole ? 0 : lumi_engine_image_bytes(run, stage);
    const int wanted = MIN(run->threads, MAX(1, images));
    struct lumi_resources resources;

    lumi_resources_find("", &resources);
    const int count = lumi_engine_threads(&resources, bytes, wanted);
    if (count < wanted && say_line) {
        g_autofree char *line = g_strdup_printf("%s: %d images at once instead of %d: %.1f GB are left (%s), an image "
                                                "takes %.1f",
                                                stage->name, count, wanted, (double)resources.memory / 1e9,
                                                resources.memory_by, (double)bytes / 1e9);
        say_line(line);
    }
    return stage->serial || stage->whole ? run->threads : count;
}

void lumi_engine_use_local(struct lumi_run *run, void (*say)(const char *line))
{
    struct lumi_resources resources;

    say_line = say;
    lumi_resources_find("", &resources);
    if (run->threads <= 0)
        run->threads = resources.cores;
    run->parallel = choose;
}
