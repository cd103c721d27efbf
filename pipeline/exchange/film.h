/* Videos, picture by picture: whatever container and codec the libraries know, as a camera wrote it.
 *
 * 1. Times are the file's own time stamps, from the begin of the video: a frame rate is neither needed nor trusted.
 * 2. A file is opened with nothing but its own bytes: no other file and no network is reached, whatever it says.
 * 3. What breaks off or is damaged is told, and what can be read is read. Nothing is printed.
 * 4. One thread a film, so that the pictures of a damaged file do not depend on how many there are. */
#ifndef LUMI_PIPELINE_EXCHANGE_FILM_H
#define LUMI_PIPELINE_EXCHANGE_FILM_H

#include "proto/base/raster.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct lumi_film;

struct lumi_film_info {
    int width, height;
    double duration; /* s, as the file's head says; 0: it does not */
    int rotation;    /* degrees clockwise that the file wants its pictures turned by: reported, not applied */
    bool sound;
    bool linearised; /* not in the tone curve of ordinary video: HLG, PQ, a logarithm */
    char codec[32];
};

/* LUMI_ERR_NOTFOUND, LUMI_ERR_IO, LUMI_ERR_FORMAT (no video that can be read), LUMI_ERR_UNSUPPORTED, LUMI_ERR_LIMIT. */
int lumi_film_open(const char *path, struct lumi_film **film, struct lumi_error *error);
/* The bytes stay the caller's, and there until it is closed; `name` stands for the path in errors. */
int lumi_film_open_memory(const void *data, size_t size, const char *name, struct lumi_film **film,
                          struct lumi_error *error);
/* Accepts NULL. */
void lumi_film_close(struct lumi_film *film);
const struct lumi_film_info *lumi_film_info(const struct lumi_film *film);

struct lumi_film_picture {
    double time;  /* s */
    bool damaged; /* the decoder had to make up a part of it */
};
/* The next picture in the order they are shown. *there false: the video ends. Why it ended before its time, or lacks
 * pictures: lumi_film_damage. */
int lumi_film_next(struct lumi_film *film, struct lumi_film_picture *picture, bool *there, struct lumi_error *error);
/* NULL: none was found so far. Owned by the film. */
const char *lumi_film_damage(const struct lumi_film *film);

/* The current picture's brightness in columns × rows blocks, 0 … 1, row by row. */
int lumi_film_blocks(struct lumi_film *film, int columns, int rows, float *blocks, struct lumi_error *error);
/* The current picture: RGB, 8 bits, or 16 where the video has more than 8. */
int lumi_film_raster(struct lumi_film *film, struct lumi_raster *raster, struct lumi_error *error);

/* How loud it is, `rate` values a second from the video's begin, 0 … 1: of a film that was just opened, which is of no
 * further use then. *values is released with g_free; NULL and 0: it has no sound. */
int lumi_film_sound(struct lumi_film *film, double rate, float **values, int *count, struct lumi_error *error);

#endif
