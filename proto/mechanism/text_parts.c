/* Lines and numbers of the text forms. */
#include "proto/mechanism/text_line.h"
#include "proto/mechanism/text_priv.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool lumi_text_line(const char *text, size_t size, size_t *at, char *line, size_t room)
{
    const char *begin = text + *at, *end = memchr(begin, '\n', size - *at);
    size_t length = end ? (size_t)(end - begin) : size - *at;

    *at += length + 1;
    if (length >= room || memchr(begin, '\0', length))
        return false;
    memcpy(line, begin, length);
    line[length] = '\0';
    return true;
}

char *text_trim(char *text)
{
    char *end;

    text += strspn(text, " \t\r");
    end = text + strlen(text);
    while (end > text && strchr(" \t\r", end[-1]))
        *--end = '\0';
    return text;
}

bool text_split(char *text, char **value)
{
    char *equals = strchr(text, '=');

    if (!equals)
        return false;
    *equals = '\0';
    *value = text_trim(equals + 1);
    text_trim(text);
    return true;
}

/* strtod and printf take the decimal point from the program's locale; profiles always have '.'. */
static char locale_point(void)
{
    const struct lconv *conventions = localeconv();

    return conventions && conventions->decimal_point[0] ? conventions->decimal_point[0] : '.';
}

bool text_read_real(const char *text, double *value)
{
    char copy[64], *end;
    size_t length = strlen(text);

    if (length == 0 || length >= sizeof copy || strspn(text, "+-.0123456789eE") != length)
        return false;
    memcpy(copy, text, length + 1);
    for (char *c = copy; *c; c++)
        if (*c == '.')
            *c = locale_point();
    *value = strtod(copy, &end);
    return *end == '\0' && isfinite(*value);
}

bool text_read_integer(const char *text, int *value)
{
    double number;

    if (!text_read_real(text, &number) || number != floor(number) || fabs(number) > 1e9)
        return false;
    *value = (int)number;
    return true;
}

bool text_print_real(double value, double unit, char text[TEXT_NUMBER])
{
    int digits = 1;

    /* Not "1.8e+02": a number of ordinary size shows all the places before its point. */
    for (double size = fabs(value / unit); size >= 10 && size < 1e9 && digits < 9; size /= 10)
        digits++;
    for (; digits <= 17; digits++) {
        double back;
        snprintf(text, TEXT_NUMBER, "%.*g", digits, value / unit);
        for (char *c = text; *c; c++)
            if (*c == locale_point())
                *c = '.';
        if (text_read_real(text, &back) && back * unit == value)
            return true;
    }
    return false;
}

void text_put(struct text_printer *printer, const char *string)
{
    size_t length = strlen(string);

    if (printer->length < printer->size) {
        size_t room = printer->size - printer->length - 1, count = length < room ? length : room;
        memcpy(printer->text + printer->length, string, count);
        printer->text[printer->length + count] = '\0';
    }
    printer->length += length;
}

void text_put_pair(struct text_printer *printer, const char *key, const char *unit, const char *value)
{
    text_put(printer, key);
    text_put(printer, unit);
    text_put(printer, " = ");
    text_put(printer, value);
    text_put(printer, "\n");
}
