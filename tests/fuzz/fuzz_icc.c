/* An ICC profile from memory, for encoded and for linear pictures. */
#include "checks.h"

#include "pipeline/color/icc.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    for (int linear = 0; linear < 2; linear++) {
        float pixels[6] = {0, 0.25f, 1, 3, 0.5f, 0.001f};
        struct lumi_error error = {0};
        struct lumi_icc *icc;
        if (checked(lumi_icc_create(data, size, "fuzz", linear, &icc, &error), &error) == LUMI_OK)
            lumi_icc_apply(icc, pixels, 2);
        lumi_icc_destroy(icc);
    }
    return 0;
}
