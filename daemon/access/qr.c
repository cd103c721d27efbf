/* A short text as a square, by libqrencode. */
#include "daemon/access/qr.h"

#include <errno.h>
#include <glib.h>
#include <qrencode.h>

#define MARGIN 4 /* ISO/IEC 18004, 6.3.8: four modules of white all round */

static int encode(const char *text, QRcode **code, struct lumi_error *error)
{
    *code = QRcode_encodeString8bit(text, 0, QR_ECLEVEL_M);
    if (*code)
        return LUMI_OK;
    return errno == ENOMEM ? lumi_fail(error, LUMI_ERR_NOMEM, "QR code: no memory")
                           : lumi_fail(error, LUMI_ERR_LIMIT, "QR code: the text is empty or too long");
}

static bool is_dark(const QRcode *code, int x, int y)
{
    x -= MARGIN;
    y -= MARGIN;
    return x >= 0 && y >= 0 && x < code->width && y < code->width && (code->data[y * code->width + x] & 1);
}

int lumi_qr_svg(const char *text, char **svg, struct lumi_error *error)
{
    QRcode *code;

    LUMI_TRY(encode(text, &code, error));
    int size = code->width + 2 * MARGIN;
    GString *out = g_string_new(NULL);
    g_string_append_printf(out,
                           "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" "
                           "shape-rendering=\"crispEdges\"><path fill=\"#fff\" d=\"M0 0h%dv%dH0z\"/><path d=\"",
                           size, size, size, size);
    for (int y = 0; y < size; y++)
        for (int x = 0, end; x < size; x = end) {
            for (end = x; end < size && is_dark(code, end, y); end++)
                continue;
            if (end > x)
                g_string_append_printf(out, "M%d %dh%dv1H%dz", x, y, end - x, x);
            else
                end = x + 1;
        }
    g_string_append(out, "\"/></svg>");
    QRcode_free(code);
    *svg = g_string_free(out, FALSE);
    return LUMI_OK;
}

/* Two rows a line. What is drawn is the light ones where the terminal's own colours are kept: most are dark. */
int lumi_qr_terminal(const char *text, bool coloured, char **lines, struct lumi_error *error)
{
    static const char *const blocks[] = {" ", "▄", "▀", "█"};
    QRcode *code;

    LUMI_TRY(encode(text, &code, error));
    int size = code->width + 2 * MARGIN;
    GString *out = g_string_new(NULL);
    for (int y = 0; y < size; y += 2) {
        g_string_append(out, coloured ? "\033[97;40m" : "");
        for (int x = 0; x < size; x++)
            g_string_append(out, blocks[2 * !is_dark(code, x, y) + (y + 1 >= size || !is_dark(code, x, y + 1))]);
        g_string_append(out, coloured ? "\033[0m\n" : "\n");
    }
    QRcode_free(code);
    *lines = g_string_free(out, FALSE);
    return LUMI_OK;
}
