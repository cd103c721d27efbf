/* Within exchange: reading each kind of source from the disk, with its files looked up. */
#ifndef LUMI_PIPELINE_EXCHANGE_IMPORT_SOURCE_H
#define LUMI_PIPELINE_EXCHANGE_IMPORT_SOURCE_H

#include "pipeline/exchange/exchange.h"

/* Fills exchange with all images, image->path where the file lies (or should lie). */
int exchange_read_source(const char *source, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                         struct lumi_error *error);

/* Gives every image a name that is safe and unique. LUMI_ERR_FORMAT for two images of one name. */
int exchange_name_images(struct lumi_exchange *exchange, const char *source, struct lumi_error *error);

#endif
