/* What a camera makes of light: the linear light behind each of its 256 codes, and pictures turned back by it. */
#ifndef LUMI_PIPELINE_HDR_RESPONSE_H
#define LUMI_PIPELINE_HDR_RESPONSE_H

#include "proto/base/raster.h"

#include <stddef.h>

/* light[c][z]: what channel c saw where its code is z, from 0 to 1 and never falling. */
struct lumi_response {
    float light[3][256];
};

void lumi_response_srgb(struct lumi_response *response);
/* Codes that are proportional to light. */
void lumi_response_linear(struct lumi_response *response);

/* The text form (docs/hdr.md): "lumisphere-response 1", then 256 lines of three numbers; or several such tables, each
 * after a line "camera NAME". `camera`: whose is wanted; a table without a name is everybody's. `name` stands for the
 * file in errors. LUMI_ERR_NOTFOUND: there is none for this camera. */
int lumi_response_parse(const char *text, size_t size, const char *name, const char *camera,
                        struct lumi_response *response, struct lumi_error *error);
/* The head, and a table after it; both to be put one behind the other. Release with lumi_free. */
#define LUMI_RESPONSE_HEAD "lumisphere-response 1\n"
int lumi_response_format(const struct lumi_response *response, const char *camera, char **text,
                         struct lumi_error *error);

/* A picture (3 channels) as linear light, 1.0 its white: U8 and U16 through the response, F32 as it is. */
int lumi_response_apply(const struct lumi_response *response, const struct lumi_raster *picture,
                        struct lumi_raster *linear, struct lumi_error *error);

/* For the estimate: the codes of one place in all shots of a bracket. */
struct lumi_response_sample {
    uint8_t code[3];
    int place;          /* samples with the same number are of the same light */
    float log_exposure; /* natural logarithm */
};

/* Debevec and Malik, "Recovering high dynamic range radiance maps from photographs", 1997, a channel at a time; then
 * made monotone (pool adjacent violators). Places are numbered from 0 and samples sorted by them. LUMI_ERR_FORMAT where
 * they do not tell: fewer than 50 places, or all shots alike. */
int lumi_response_estimate(const struct lumi_response_sample *samples, int count, struct lumi_response *response,
                           struct lumi_error *error);

#endif
