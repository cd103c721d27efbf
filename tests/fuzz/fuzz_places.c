/* The reader of places: what it takes is sound. */
#include "checks.h"

#include "pipeline/run/places.h"

#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_places places;

    if (checked(lumi_places_parse((const char *)data, size, "fuzz", &places, &error), &error) != LUMI_OK)
        return 0;
    for (int i = 0; i < places.lens_count; i++)
        if (!lumi_lens_valid(&places.lenses[i]))
            abort();
    for (int i = 0; i < places.count; i++) {
        const struct lumi_place *place = &places.items[i];
        if (place->lens < 0 || place->lens >= places.lens_count || !lumi_pose_valid(&place->pose, 1e-6) ||
            strchr(place->name, '/') || place->name[0] == '.' || lumi_places_find(&places, place->name) != i)
            abort();
    }
    lumi_places_finish(&places);
    return 0;
}
