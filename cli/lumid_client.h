/* lumid, as the commands reach it: its API over HTTP (docs/api.md). */
#ifndef LUMI_CLI_LUMID_CLIENT_H
#define LUMI_CLI_LUMID_CLIENT_H

#include "cli/command.h"
#include "cli/lumid_answer.h"

extern char *cli_lumid_address, *cli_lumid_token_file, *cli_lumid_ca;
#define CLI_LUMID_OPTIONS                                                                                              \
    {"lumid",                                                                                                          \
     0,                                                                                                                \
     0,                                                                                                                \
     G_OPTION_ARG_STRING,                                                                                              \
     &cli_lumid_address,                                                                                               \
     "where lumid is: HOST, HOST:PORT or https://HOST:PORT (localhost:8470; LUMID_ADDRESS in the environment)",        \
     "URL"},                                                                                                           \
        {"token-file",                                                                                                 \
         0,                                                                                                            \
         0,                                                                                                            \
         G_OPTION_ARG_FILENAME,                                                                                        \
         &cli_lumid_token_file,                                                                                        \
         "a file with the token of a lumid elsewhere (LUMID_TOKEN in the environment is the token itself)",            \
         "FILE"},                                                                                                      \
    {                                                                                                                  \
        "ca", 0, 0, G_OPTION_ARG_FILENAME, &cli_lumid_ca,                                                              \
            "PEM file with the certificate that lumid's is signed by, or lumid's own (LUMID_CA)", "FILE"               \
    }
/* Where it stands what the options do, for descriptions. */
#define CLI_LUMID_WHERE                                                                                                \
    "lumid is looked for where --lumid says, then LUMID_ADDRESS in the environment, then the group [lumid] with the "  \
    "keys address, token_file and ca in lumisphere/lumi.conf of the user's configuration folder, then where "          \
    "/etc/lumisphere/lumid.conf makes it listen, then at localhost:8470."

struct cli_lumid;
/* Nobody is asked yet. LUMI_ERR_ARG: an address that is none; LUMI_ERR_NOTFOUND, …: a file that cannot be read. */
int cli_lumid_open(struct cli_lumid **lumid, struct lumi_error *error);
void cli_lumid_close(struct cli_lumid *lumid);
const char *cli_lumid_url(const struct cli_lumid *lumid); /* "http://localhost:8470" */
/* A problem document becomes its code and text. LUMI_ERR_IO: nobody answers, or it is no lumid that does.
 * `*root` (transfer full): json_node_unref; always an object. `text` may be NULL, otherwise (transfer full) the answer
 * as it came. */
int cli_lumid_get(struct cli_lumid *lumid, const char *path, JsonNode **root, char **text, struct lumi_error *error);
/* `body` may be NULL: nothing has to be said. */
int cli_lumid_post(struct cli_lumid *lumid, const char *path, JsonBuilder *body, JsonNode **root, char **text,
                   struct lumi_error *error);
/* Events until `event` returns false, each with its kind and its data as they came, and parsed (an object, or NULL). A
 * connection that breaks is made again where the last one ended, for `patience` seconds; then LUMI_ERR_IO. */
int cli_lumid_events(struct cli_lumid *lumid, double patience, cli_lumid_event_fn event, void *context,
                     struct lumi_error *error);

#endif
