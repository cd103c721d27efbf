/* A recogniser for RFC 8259 with a bounded stack: it says whether, not what. */
#include "proto/base/json_check.h"

#include <string.h>

#define MAX_DEPTH 32

struct scan {
    const char *at, *end;
};

static void skip_space(struct scan *scan)
{
    while (scan->at < scan->end && (*scan->at == ' ' || *scan->at == '\t' || *scan->at == '\n' || *scan->at == '\r'))
        scan->at++;
}

static bool take(struct scan *scan, char c)
{
    if (scan->at >= scan->end || *scan->at != c)
        return false;
    scan->at++;
    return true;
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static bool take_digits(struct scan *scan)
{
    const char *start = scan->at;

    while (scan->at < scan->end && is_digit(*scan->at))
        scan->at++;
    return scan->at > start;
}

static bool take_number(struct scan *scan)
{
    take(scan, '-');
    if (!take(scan, '0') && !take_digits(scan))
        return false;
    if (take(scan, '.') && !take_digits(scan))
        return false;
    if (take(scan, 'e') || take(scan, 'E')) {
        if (!take(scan, '+'))
            take(scan, '-');
        return take_digits(scan);
    }
    return true;
}

static bool is_hex(char c)
{
    return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/* The four digits after "\\u". Halves of surrogate pairs that stand alone are no characters: they would come back as
 * broken text. */
static bool take_code_unit(struct scan *scan, unsigned *unit)
{
    *unit = 0;
    for (int i = 0; i < 4; i++, scan->at++) {
        if (scan->at >= scan->end || !is_hex(*scan->at))
            return false;
        char c = *scan->at;
        *unit = *unit << 4 | (unsigned)(is_digit(c) ? c - '0' : (c | 0x20) - 'a' + 10);
    }
    return true;
}

static bool take_escaped_character(struct scan *scan)
{
    unsigned first, second;

    if (!take_code_unit(scan, &first) || (first & 0xfc00) == 0xdc00)
        return false;
    if ((first & 0xfc00) != 0xd800)
        return true;
    return take(scan, '\\') && take(scan, 'u') && take_code_unit(scan, &second) && (second & 0xfc00) == 0xdc00;
}

static bool take_string(struct scan *scan)
{
    if (!take(scan, '"'))
        return false;
    while (scan->at < scan->end) {
        char c = *scan->at++;
        if (c == '"')
            return true;
        if ((unsigned char)c < 0x20)
            return false;
        if (c != '\\')
            continue;
        if (scan->at >= scan->end || !strchr("\"\\/bfnrtu", *scan->at) || !*scan->at)
            return false;
        if (*scan->at++ == 'u' && !take_escaped_character(scan))
            return false;
    }
    return false;
}

static bool take_word(struct scan *scan, const char *word)
{
    size_t length = strlen(word);

    if ((size_t)(scan->end - scan->at) < length || memcmp(scan->at, word, length) != 0)
        return false;
    scan->at += length;
    return true;
}

static bool take_scalar(struct scan *scan)
{
    return take_string(scan) || take_word(scan, "true") || take_word(scan, "false") || take_word(scan, "null") ||
           take_number(scan);
}

static bool take_key(struct scan *scan)
{
    skip_space(scan);
    if (!take_string(scan))
        return false;
    skip_space(scan);
    return take(scan, ':');
}

const char *lumi_json_fault(const char *text, size_t size)
{
    struct scan scan = {text, text + size};
    char open[MAX_DEPTH];
    int depth = 0;

    for (;;) {
        /* A value is due here. */
        skip_space(&scan);
        char c = scan.at < scan.end ? *scan.at : '\0';
        if (c == '[' || c == '{') {
            if (depth == MAX_DEPTH)
                return scan.at;
            open[depth++] = c == '[' ? ']' : '}';
            scan.at++;
            skip_space(&scan);
            if (!take(&scan, open[depth - 1])) {
                if (c == '{' && !take_key(&scan))
                    return scan.at;
                continue;
            }
            depth--;
        } else if (!take_scalar(&scan)) {
            return scan.at;
        }
        /* Behind a value: what it is part of goes on or ends. */
        for (;;) {
            skip_space(&scan);
            if (depth == 0)
                return scan.at == scan.end ? NULL : scan.at;
            if (take(&scan, ',')) {
                if (open[depth - 1] == '}' && !take_key(&scan))
                    return scan.at;
                break;
            }
            if (!take(&scan, open[depth - 1]))
                return scan.at;
            depth--;
        }
    }
}

bool lumi_json_check(const char *text, size_t size)
{
    return lumi_json_fault(text, size) == NULL;
}
