/* File names of the Stanford Light Field Archive's kind. */
#include "pipeline/exchange/exchange.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_exchange_stanford place;
    char *name = malloc(size + 1);

    if (!name)
        return 0;
    memcpy(name, data, size);
    name[size] = '\0';
    if (lumi_exchange_parse_stanford(name, &place) &&
        (place.row < 0 || place.column < 0 || !isfinite(place.x) || !isfinite(place.y)))
        abort();
    free(name);
    return 0;
}
