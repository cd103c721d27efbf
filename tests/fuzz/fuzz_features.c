/* The reader of ".feat" files against any bytes, with a checksum that fits; what it accepts is within its limits. */
#include "checks.h"

#include "pipeline/calibrate/features.h"

static void decode(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_features features;

    if (checked(lumi_features_decode(data, size, "fuzz", &features, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < features.count; i++)
        if (!(features.items[i].x >= 0 && features.items[i].x <= (float)features.width && features.items[i].scale > 0))
            abort();
    lumi_features_finish(&features);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_checksum(data, size, decode);
    return 0;
}
