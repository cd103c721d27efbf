/* transforms.json from memory: what is accepted is sound, and written and read again is the same. */
#include "checks.h"

#include "pipeline/exchange/exchange.h"

static void check(const struct lumi_exchange *list)
{
    for (guint i = 0; i < list->images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(list, (int)i);
        if (!image->original || image->camera < 0 || image->camera >= (int)list->cameras->len ||
            !lumi_pose_valid(&image->pose, 1e-3))
            abort();
    }
}

/* Cameras that leave their focal length to an angle are written only once their size is known. */
static bool complete(const struct lumi_exchange *list)
{
    for (guint i = 0; i < list->cameras->len; i++)
        if (lumi_exchange_camera(list, (int)i)->parameter_count == 0)
            return false;
    return true;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_exchange list, again;
    struct lumi_error error = {0};

    lumi_exchange_init(&list);
    lumi_exchange_init(&again);
    if (checked(lumi_exchange_parse_transforms((const char *)data, size, "fuzz", &list, &error), &error) == LUMI_OK) {
        g_autofree char *text = NULL;
        check(&list);
        if (complete(&list) && lumi_exchange_format_transforms(&list, &text, &error) == LUMI_OK &&
            (lumi_exchange_parse_transforms(text, strlen(text), "fuzz", &again, &error) != LUMI_OK ||
             again.images->len != list.images->len))
            abort();
    }
    lumi_exchange_finish(&list);
    lumi_exchange_finish(&again);
    return 0;
}
