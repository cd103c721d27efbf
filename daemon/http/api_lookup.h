/* Answers that have to be looked for on disks and buses: in the worker, so that the server goes on. */
#ifndef LUMI_DAEMON_HTTP_API_LOOKUP_H
#define LUMI_DAEMON_HTTP_API_LOOKUP_H

#include "daemon/http/api_priv.h"

struct lumi_api_lookup {
    struct lumi_api_job job;
    struct lumi_http *http; /* its options stay as long as the worker lives */
    SoupServerMessage *message;
    bool gone; /* who asked has hung up */
    char name[LUMI_API_STRING_MAX + 1];
    void (*look)(struct lumi_api_lookup *lookup);
    /* What was found: a code with its text, or JSON, or bytes of some type (lumi_free). */
    int code;
    struct lumi_error error;
    char *text;
    const char *type;
    uint8_t *data;
    size_t size;
};
void lumi_api_look_up(struct lumi_http *http, SoupServerMessage *message, void (*look)(struct lumi_api_lookup *lookup),
                      const char *name);

#endif
