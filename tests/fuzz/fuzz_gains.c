/* A table of gains from memory: what is accepted makes a picture no worse than darker or brighter. */
#include "checks.h"

#include "pipeline/equiangular/gains.h"

#include <math.h>

static void read_gains(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_gains gains;

    if (checked(lumi_gains_parse((const char *)data, size, "fuzz", &gains, &error), &error) == LUMI_OK) {
        for (int i = 0; i < gains.count; i++)
            if (gains.items[i].lens < 0 || gains.items[i].lens >= gains.lens_count || !gains.items[i].name[0] ||
                lumi_gains_find(&gains, gains.items[i].name) != &gains.items[i])
                abort();
    }
    lumi_gains_finish(&gains);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_gains);
    return 0;
}
