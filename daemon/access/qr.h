/* A short text as a square that a phone reads. */
#ifndef LUMI_DAEMON_ACCESS_QR_H
#define LUMI_DAEMON_ACCESS_QR_H

#include "proto/base/result.h"

#include <stdbool.h>

/* (transfer full: g_free) An SVG image, black on white with its margin; and lines of half blocks for a terminal,
 * `coloured`: black on white whatever its colours are. LUMI_ERR_LIMIT: too long a text. */
int lumi_qr_svg(const char *text, char **svg, struct lumi_error *error);
int lumi_qr_terminal(const char *text, bool coloured, char **lines, struct lumi_error *error);

#endif
