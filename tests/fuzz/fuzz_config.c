/* lumid's configuration. What is taken must be sound: names that end, numbers within their bounds, lines with a chip;
 * whatever is refused says where. */
#include "checks.h"

#include "daemon/lumid/config_keys.h"

#include <math.h>
#include <stdio.h>

static int told;

static void problem(void *context, const char *text)
{
    (void)context;
    told++;
    if (strncmp(text, "fuzz:", 5) != 0 || strlen(text) < 8)
        abort();
    for (; *text; text++)
        if ((unsigned char)*text < ' ')
            abort();
}

static void check_key(const struct lumi_config_key *key, const void *base)
{
    const char *at = (const char *)base + key->offset;

    if (key->kind <= LUMI_CONFIG_CAMERA && !memchr(at, 0, key->bytes))
        abort();
    if (key->kind == LUMI_CONFIG_FLAG && *(const unsigned char *)at > 1)
        abort();
    if (key->kind == LUMI_CONFIG_NUMBER && (*(const int *)at < key->least || *(const int *)at > key->most))
        abort();
    if (key->kind == LUMI_CONFIG_REAL && !(*(const double *)at >= key->least && *(const double *)at <= key->most))
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct lumi_config config;
    struct lumi_error error = {0};

    told = 0;
    int code = checked(lumi_config_parse((const char *)data, size, "fuzz", &config, problem, NULL, &error), &error);
    if ((code == LUMI_OK) != (told == 0))
        abort();
    if (code != LUMI_OK)
        return 0;
    for (int i = 0; i < lumi_config_key_count; i++)
        for (int k = 0; k < (strcmp(lumi_config_keys[i].group, "camera") == 0 ? config.engine.camera_count : 1); k++)
            if (strcmp(lumi_config_keys[i].group, "camera") == 0)
                check_key(&lumi_config_keys[i], &config.engine.cameras[k]);
            else
                check_key(&lumi_config_keys[i], &config);
    for (int i = 0; i < config.gpio_count; i++)
        if (!config.gpio[i].chip[0] || (config.gpio[i].offset < 0 && !config.gpio[i].line_name[0]))
            abort();
    for (int i = 0; i < config.engine.camera_count; i++)
        if (!config.engine.cameras[i].name[0] || !config.engine.cameras[i].address[0])
            abort();
    return 0;
}
