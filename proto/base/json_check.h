/* JSON, checked before it is parsed. */
#ifndef LUMI_PROTO_BASE_JSON_CHECK_H
#define LUMI_PROTO_BASE_JSON_CHECK_H

#include <stdbool.h>
#include <stddef.h>

/* True if text is one value by the grammar of RFC 8259, nested at most 32 deep. JSON-GLib's parser takes more
 * (comments, assignments) and recurses as deep as the text tells it to, so nothing reaches it unchecked. */
bool lumi_json_check(const char *text, size_t size);
/* NULL where the text is so; otherwise where it stops being so (its end, if it ends too early). */
const char *lumi_json_fault(const char *text, size_t size);

#endif
