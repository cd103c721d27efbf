/* What the shared code wants of a C library and this image has no room for: error texts without stdio, errno without
 * newlib's per-thread state. */
#include "proto/base/result.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* newlib's mathematics sets it; nobody reads it. */
int *__errno(void);
int *__errno(void)
{
    static int number;
    return &number;
}

struct text {
    char *data;
    size_t size, at; /* room with the final zero; length so far */
};

static void put(struct text *text, char letter)
{
    if (text->at + 1 < text->size)
        text->data[text->at++] = (unsigned char)letter < ' ' || letter == 0x7f ? '?' : letter;
}

static void put_string(struct text *text, const char *string)
{
    for (; *string; string++)
        put(text, *string);
}

static void put_unsigned(struct text *text, uint64_t value, int least)
{
    char digits[20];
    int count = 0;

    do {
        digits[count++] = (char)('0' + value % 10);
        value /= 10;
    } while (value || count < least);
    while (count)
        put(text, digits[--count]);
}

static void put_signed(struct text *text, int64_t value)
{
    if (value < 0)
        put(text, '-');
    put_unsigned(text, value < 0 ? -(uint64_t)value : (uint64_t)value, 1);
}

/* Six significant digits, as %g; no rounding across a power of ten is missed: 999999.5 is 1e+06. */
static void put_double(struct text *text, double value)
{
    int exponent = 0, digits = 6;
    uint32_t whole;

    if (value < 0) {
        put(text, '-');
        value = -value;
    }
    if (!(value <= 1.7976931348623157e308)) {
        put_string(text, value > 0 ? "inf" : "nan");
        return;
    }
    if (value > 0)
        while (value < 99999.95) {
            value *= 10;
            exponent--;
            if (exponent < -330)
                break;
        }
    while (value >= 999999.5) {
        value /= 10;
        exponent++;
    }
    whole = (uint32_t)(value + 0.5); /* value is whole · 10^exponent */
    while (digits > 1 && whole % 10 == 0) {
        whole /= 10;
        exponent++;
        digits--;
    }
    if (whole == 0) {
        put(text, '0');
        return;
    }
    /* `whole` has `digits` digits. */
    const int lead = exponent + digits - 1; /* of the first digit */
    uint32_t scale = 1;
    for (int i = 1; i < digits; i++)
        scale *= 10;
    const bool scientific = lead < -4 || lead >= 6;
    for (int i = scientific ? 0 : lead; i < 0; i++) {
        put(text, '0');
        if (i == lead)
            put(text, '.');
    }
    for (int place = scientific ? 0 : lead; scale || place >= 0; place--) {
        put(text, (char)('0' + (scale ? whole / scale % 10 : 0)));
        scale /= 10;
        if (place == 0 && scale)
            put(text, '.');
    }
    if (scientific) {
        put(text, 'e');
        put(text, lead < 0 ? '-' : '+');
        put_unsigned(text, (uint64_t)(lead < 0 ? -lead : lead), 2);
    }
}

/* The conversions that the shared checks use: %% %c %d %g %s %u, %ld %lld %lu %llu %zu; precision and width are read
 * over. */
static void format_text(struct text *text, const char *format, va_list args)
{
    for (; *format; format++) {
        int longs = 0;

        if (*format != '%') {
            put(text, *format);
            continue;
        }
        do {
            format++;
            longs += *format == 'l' || *format == 'z';
        } while (*format == 'l' || *format == 'z' || *format == '.' || (*format >= '0' && *format <= '9'));
        switch (*format) {
        case 'c':
            put(text, (char)va_arg(args, int));
            break;
        case 's':
            put_string(text, va_arg(args, const char *));
            break;
        case 'd':
            put_signed(text, longs == 2 ? va_arg(args, long long) : longs ? va_arg(args, long) : va_arg(args, int));
            break;
        case 'u':
            put_unsigned(text,
                         longs == 2 ? va_arg(args, unsigned long long)
                         : longs    ? va_arg(args, unsigned long)
                                    : va_arg(args, unsigned),
                         1);
            break;
        case 'g':
            put_double(text, va_arg(args, double));
            break;
        default:
            put(text, *format);
            if (!*format)
                return;
            break;
        }
    }
}

int lumi_fail(struct lumi_error *error, int code, const char *format, ...)
{
    if (error) {
        struct text text = {error->text, sizeof error->text, 0};
        va_list args;

        va_start(args, format);
        error->code = code;
        format_text(&text, format, args);
        text.data[text.at] = 0;
        va_end(args);
    }
    return code;
}
