/* Keys of outputs: SHA-256 of everything an output depends on. */
#ifndef LUMI_PIPELINE_RUN_KEY_H
#define LUMI_PIPELINE_RUN_KEY_H

#include "pipeline/run/run.h"

#include <nettle/sha2.h>

#define LUMI_KEY_HEX (2 * SHA256_DIGEST_SIZE + 1)

struct lumi_key {
    struct sha256_ctx hash;
    bool missing;           /* an input is not there */
    char missing_what[128]; /* which */
};

void lumi_key_init(struct lumi_key *key, const char *stage, int version);
void lumi_key_hex(struct lumi_key *key, char hex[LUMI_KEY_HEX]);

/* The key beside an output: "<name>.key" holds the hex key, the output's size in bytes and its file name. False if
 * there is none, it is malformed, or the output is not there with that size. */
bool lumi_key_load(const char *key_path, char hex[LUMI_KEY_HEX]);
/* Written under a temporary name and renamed; `output` is the file it speaks of, in the same folder. */
int lumi_key_save(const char *key_path, const char *output, const char *hex, struct lumi_error *error);

#endif
