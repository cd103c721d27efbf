/* A .cube file from memory: what is accepted gives finite colours, whatever it is asked for. */
#include "checks.h"

#include "pipeline/color/cube.h"

#include <math.h>

static void read_cube(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_cube cube;

    if (checked(lumi_cube_parse((const char *)data, size, "fuzz", &cube, &error), &error) == LUMI_OK) {
        for (int i = 0; i < 64; i++) {
            const float in[3] = {(float)(i % 4) - 1, (float)(i / 4 % 4) / 3, i / 16 == 3 ? NAN : (float)(i / 16)};
            float out[3];
            lumi_cube_apply(&cube, in, out);
            for (int c = 0; c < 3; c++)
                if (!isfinite(out[c]))
                    abort();
        }
    }
    lumi_cube_finish(&cube);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_cube);
    return 0;
}
