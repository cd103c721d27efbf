/* The grade of a capture from memory. */
#include "checks.h"

#include "pipeline/color/grade.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_grade grade = {.linear = false};
    struct lumi_error error = {0};

    if (checked(lumi_grade_parse((const char *)data, size, "fuzz", &grade, &error), &error) == LUMI_OK) {
        float rgb[3] = {2, 0.5f, 0};
        lumi_tone_apply(&grade.map, rgb);
        if (isnan(rgb[0]) || grade.map.tone == LUMI_TONE_AUTO)
            abort();
    }
    return 0;
}
