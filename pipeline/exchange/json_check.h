/* JSON, checked before it is parsed. */
#ifndef LUMI_PIPELINE_EXCHANGE_JSON_CHECK_H
#define LUMI_PIPELINE_EXCHANGE_JSON_CHECK_H

#include <stdbool.h>
#include <stddef.h>

/* True if text is one value by the grammar of RFC 8259, nested at most 32 deep. JSON-GLib's parser takes more
 * (comments, assignments) and recurses as deep as the text tells it to, so nothing reaches it unchecked. */
bool lumi_json_check(const char *text, size_t size);

#endif
