/* Captures on the shelf: found by name, shown by a small picture, carried away as one file, thrown away. No thread;
 * nothing here changes a capture, but for throwing it away.
 *
 * A name is one of a directory in the captures' folder, and nothing else: no path, no link, nothing with a dot first,
 * nothing that is still being taken in (NAME.partial). */
#ifndef LUMI_DAEMON_SHELF_SHELF_H
#define LUMI_DAEMON_SHELF_SHELF_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_SHELF_PATH 2048

/* LUMI_ERR_NOTFOUND: there is no capture of this name. */
int lumi_shelf_find(const char *folder, const char *name, char path[LUMI_SHELF_PATH], struct lumi_error *error);

/* Makes `file`, a JPEG of at most 320 pixels along its longer side, of a frame from the middle of the capture.
 * LUMI_ERR_NOTFOUND: it has none. */
int lumi_shelf_thumbnail(const char *capture, const char *file, struct lumi_error *error);

/* ---- as one file ---- */

/* A tar (ustar, with pax headers where a name or a size wants them) of a sealed capture, its files by name under NAME/.
 * The same capture has the same bytes, so that a download that broke off goes on where it was. */
struct lumi_shelf_bundle;
/* LUMI_ERR_BUSY: it is not sealed. */
int lumi_shelf_bundle_open(const char *capture, const char *name, struct lumi_shelf_bundle **bundle,
                           struct lumi_error *error);
void lumi_shelf_bundle_close(struct lumi_shelf_bundle *bundle); /* NULL is fine */
int64_t lumi_shelf_bundle_size(const struct lumi_shelf_bundle *bundle);
const char *lumi_shelf_bundle_seal(const struct lumi_shelf_bundle *bundle);
/* Bytes from `offset` on, as many as there are up to `size`; *got. LUMI_ERR_IO: a file is no longer what it was. */
int lumi_shelf_bundle_read(struct lumi_shelf_bundle *bundle, int64_t offset, void *data, size_t size, size_t *got,
                           struct lumi_error *error);

/* ---- thrown away ---- */

/* Renames it to .deleted-NAME, which is no capture any more. LUMI_ERR_BUSY: somebody writes it. */
int lumi_shelf_take_away(const char *folder, const char *name, struct lumi_error *error);
/* Removes everything called .deleted-ANYTHING in the folder, also what an earlier program left. `ending` may be NULL:
 * asked now and then, true ends it. */
int lumi_shelf_empty(const char *folder, bool (*ending)(void *context), void *context, struct lumi_error *error);

#endif
