/* Keys of outputs. */
#include "pipeline/run/key.h"

#include "pipeline/run/temporary.h"

#include <errno.h>
#include <glib.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

void lumi_key_init(struct lumi_key *key, const char *stage, int version)
{
    *key = (struct lumi_key){0};
    sha256_init(&key->hash);
    lumi_key_bytes(key, stage, strlen(stage) + 1);
    lumi_key_int(key, version);
}

void lumi_key_bytes(struct lumi_key *key, const void *data, size_t size)
{
    sha256_update(&key->hash, size, data);
}

/* As eight little-endian bytes, so that a key does not depend on the machine. */
static void add_u64(struct lumi_key *key, uint64_t value)
{
    uint8_t bytes[8];

    for (int i = 0; i < 8; i++)
        bytes[i] = (uint8_t)(value >> (8 * i));
    lumi_key_bytes(key, bytes, sizeof bytes);
}

void lumi_key_int(struct lumi_key *key, long long value)
{
    add_u64(key, (uint64_t)value);
}

void lumi_key_double(struct lumi_key *key, double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    add_u64(key, bits);
}

void lumi_key_hex(struct lumi_key *key, char hex[LUMI_KEY_HEX])
{
    uint8_t digest[SHA256_DIGEST_SIZE];

    sha256_digest(&key->hash, sizeof digest, digest);
    for (int i = 0; i < SHA256_DIGEST_SIZE; i++)
        snprintf(hex + 2 * i, 3, "%02x", digest[i]);
}

bool lumi_key_load(const char *key_path, char hex[LUMI_KEY_HEX])
{
    g_autofree char *text = NULL, *folder = g_path_get_dirname(key_path);
    struct stat status;
    char name[128];
    int64_t size;

    if (!g_file_get_contents(key_path, &text, NULL, NULL) ||
        sscanf(text, "%64[0-9a-f] %" SCNd64 " %127[^/\n]", hex, &size, name) != 3)
        return false;
    g_autofree char *output = g_build_filename(folder, name, NULL);
    return strlen(hex) == LUMI_KEY_HEX - 1 && stat(output, &status) == 0 && status.st_size == size;
}

int lumi_key_save(const char *key_path, const char *output, const char *hex, struct lumi_error *error)
{
    g_autofree char *temporary = lumi_run_temporary(key_path, "");
    g_autofree char *name = g_path_get_basename(output);
    struct stat status;

    if (stat(output, &status))
        return lumi_fail_errno(error, output, "stat");
    FILE *file = fopen(temporary, "w");
    if (!file)
        return lumi_fail_errno(error, temporary, "create");
    int printed = fprintf(file, "%s %" PRId64 " %s\n", hex, (int64_t)status.st_size, name);
    if (fclose(file) || printed < 0 || rename(temporary, key_path)) {
        int code = lumi_fail_errno(error, key_path, "write");
        unlink(temporary);
        return code;
    }
    return LUMI_OK;
}
