/* What the text forms of rig and plan share: lines, numbers that come back bit for bit, a writer that measures. */
#ifndef LUMI_PROTO_MECHANISM_TEXT_PRIV_H
#define LUMI_PROTO_MECHANISM_TEXT_PRIV_H

#include <stdbool.h>
#include <stddef.h>

#define TEXT_LINE 1024 /* longest line, with its 0: a plan may name 16 cameras in one */
#define TEXT_NUMBER 40 /* longest number, with its 0 */

/* Without blanks at either end; cuts `text` in place. */
char *text_trim(char *text);
/* Splits "key = value" in place; false: there is no '='. */
bool text_split(char *text, char **value);

bool text_read_real(const char *text, double *value);
bool text_read_integer(const char *text, int *value);
/* The shortest decimal number that reads as `value` after scaling by `unit`; false if there is none. */
bool text_print_real(double value, double unit, char text[TEXT_NUMBER]);

struct text_printer {
    char *text;
    size_t size, length; /* of the room; of the whole text, whether it fits or not */
};
void text_put(struct text_printer *printer, const char *string);
/* "key" "unit" = "value" and a new line. */
void text_put_pair(struct text_printer *printer, const char *key, const char *unit, const char *value);

#endif
