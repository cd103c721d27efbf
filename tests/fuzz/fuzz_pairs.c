/* The reader of ".pairs" files against any bytes, with a checksum that fits; what it accepts is within its limits. */
#include "checks.h"

#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"

static void decode(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_pair_list list;

    if (checked(lumi_pairs_decode(data, size, "fuzz", &list, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < list.count; i++) {
        const struct lumi_pair *pair = &list.items[i];
        if (!memchr(pair->name, 0, sizeof pair->name) || pair->free_outside > pair->free_count)
            abort();
        for (int k = 0; k < pair->match_count; k++)
            if (pair->matches[k].a >= LUMI_FEATURES_MAX || pair->matches[k].b >= LUMI_FEATURES_MAX)
                abort();
    }
    lumi_pairs_finish(&list);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_checksum(data, size, decode);
    return 0;
}
