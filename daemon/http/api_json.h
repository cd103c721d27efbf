/* JSON as the API writes it. */
#ifndef LUMI_DAEMON_HTTP_API_JSON_H
#define LUMI_DAEMON_HTTP_API_JSON_H

#include <json-glib/json-glib.h>
#include <stdbool.h>
#include <stdint.h>

void lumi_api_put_object(JsonBuilder *builder, const char *name); /* until json_builder_end_object */
void lumi_api_put_array(JsonBuilder *builder, const char *name);
void lumi_api_put_bool(JsonBuilder *builder, const char *name, bool value);
void lumi_api_put_int(JsonBuilder *builder, const char *name, int64_t value);
void lumi_api_put_double(JsonBuilder *builder, const char *name, double value);    /* null for what is no number */
void lumi_api_put_text(JsonBuilder *builder, const char *name, const char *value); /* what is no UTF-8 is mended */
void lumi_api_put_time(JsonBuilder *builder, const char *name, int64_t unix_us);   /* RFC 3339, UTC, milliseconds */
/* (transfer full) The whole, in one line; the builder is empty afterwards. */
char *lumi_api_finish(JsonBuilder *builder);

#endif
