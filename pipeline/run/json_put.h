/* Members of JSON objects, one a line of code. */
#ifndef LUMI_PIPELINE_RUN_JSON_PUT_H
#define LUMI_PIPELINE_RUN_JSON_PUT_H

#include <json-glib/json-glib.h>

void lumi_put_double(JsonBuilder *builder, const char *name, double value); /* null where it is no finite number */
void lumi_put_int(JsonBuilder *builder, const char *name, gint64 value);
void lumi_put_bool(JsonBuilder *builder, const char *name, gboolean value);
void lumi_put_string(JsonBuilder *builder, const char *name, const char *value);
void lumi_put_object(JsonBuilder *builder, const char *name); /* begins it */
void lumi_put_array(JsonBuilder *builder, const char *name);

/* Ends the outermost object and says it; free with g_free. */
char *lumi_put_end(JsonBuilder *builder, gboolean pretty);

#endif
