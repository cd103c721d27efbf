/* File names of the (new) Stanford Light Field Archive, http://lightfield.stanford.edu: the rectified pictures are
 * called out_ROW_COLUMN_Y_X.png or out_ROW_COLUMN_Y_X_.png, with the camera's place on its plane. */
#include "pipeline/exchange/exchange.h"

#include <string.h>

/* A number that ends exactly at `end`. */
static bool whole(const char *start, const char *end, int *value)
{
    int result = 0;

    if (start == end || end - start > 6)
        return false;
    for (const char *c = start; c < end; c++) {
        if (!g_ascii_isdigit(*c))
            return false;
        result = result * 10 + (*c - '0');
    }
    *value = result;
    return true;
}

static bool real(const char *start, const char *end, double *value)
{
    char digits[48];
    char *stop;

    if (start == end || (size_t)(end - start) >= sizeof digits)
        return false;
    for (const char *c = start; c < end; c++)
        if (!g_ascii_isdigit(*c) && !strchr("+-.eE", *c))
            return false;
    memcpy(digits, start, (size_t)(end - start));
    digits[end - start] = '\0';
    *value = g_ascii_strtod(digits, &stop);
    return !*stop && isfinite(*value);
}

bool lumi_exchange_parse_stanford(const char *file, struct lumi_exchange_stanford *place)
{
    const char *end = strrchr(file, '.');
    const char *cut[5];

    *place = (struct lumi_exchange_stanford){0};
    if (!end || end == file)
        return false;
    if (end[-1] == '_')
        end--;
    /* From the back: four fields, each begun by a '_'; before them a prefix, possibly with '_' of its own. */
    cut[4] = end;
    for (int i = 3; i >= 0; i--) {
        const char *c = cut[i + 1];
        while (c > file && c[-1] != '_')
            c--;
        if (c == file)
            return false;
        cut[i] = c - 1;
    }
    if (cut[0] == file)
        return false;
    return whole(cut[0] + 1, cut[1], &place->row) && whole(cut[1] + 1, cut[2], &place->column) &&
           real(cut[2] + 1, cut[3], &place->y) && real(cut[3] + 1, cut[4], &place->x);
}
