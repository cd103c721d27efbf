/* Lines of a text that is not trusted, for every form that is read line by line. */
#ifndef LUMI_PROTO_MECHANISM_TEXT_LINE_H
#define LUMI_PROTO_MECHANISM_TEXT_LINE_H

#include <stdbool.h>
#include <stddef.h>

/* Copies the line that begins at *at, without its end, and moves *at behind it; false: longer than `room` with its 0,
 * or with a 0 in it. */
bool lumi_text_line(const char *text, size_t size, size_t *at, char *line, size_t room);

#endif
