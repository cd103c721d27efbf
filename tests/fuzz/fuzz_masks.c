/* The reader of ".masks" files against any bytes, with a checksum that fits; what it accepts is within its limits. */
#include "checks.h"

#include "pipeline/calibrate/mask_find.h"

static void decode(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_masks masks;

    if (checked(lumi_masks_decode(data, size, "fuzz", &masks, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < masks.count; i++) {
        const int count = lumi_mask_across(&masks.items[i]) * lumi_mask_down(&masks.items[i]);
        for (int k = 0; k < count; k++)
            if (masks.items[i].rig[k] > 1)
                abort();
    }
    lumi_masks_finish(&masks);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_checksum(data, size, decode);
    return 0;
}
