/* A camera's response from memory: what is accepted never falls, and is written and read again the same. */
#include "checks.h"

#include "pipeline/hdr/response.h"

#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char text[1 << 16];
    struct lumi_response response, again;
    struct lumi_error error = {0};
    char *table;

    if (checked(lumi_response_parse((const char *)data, size, "fuzz", "c00", &response, &error), &error) != LUMI_OK)
        return 0;
    for (int c = 0; c < 3; c++)
        for (int z = 1; z < 256; z++)
            if (!(response.light[c][z] >= response.light[c][z - 1] && response.light[c][z] <= 1))
                abort();
    if (lumi_response_format(&response, "c00", &table, &error) != LUMI_OK)
        return 0;
    snprintf(text, sizeof text, "%s%s", LUMI_RESPONSE_HEAD, table);
    if (lumi_response_parse(text, strlen(text), "fuzz", "c00", &again, &error) != LUMI_OK ||
        memcmp(&again, &response, sizeof again))
        abort();
    lumi_free(table);
    return 0;
}
