/* Within exchange: a camera's video while it is imported. */
#ifndef LUMI_PIPELINE_EXCHANGE_INGEST_FILM_H
#define LUMI_PIPELINE_EXCHANGE_INGEST_FILM_H

#include "pipeline/exchange/film.h"
#include "pipeline/exchange/film_lamp.h"
#include "pipeline/exchange/ingest_priv.h"

struct ingest_picture {
    double time;
    bool damaged, doubled;
    double motion; /* mean change since the one before */
};

struct ingest_film {
    struct lumi_film *film;
    struct lumi_film_info info;
    char *damage;                 /* what the reader said of it; NULL: nothing */
    GArray *pictures;             /* struct ingest_picture */
    GArray *blocks;               /* float: brightness of each block, picture by picture */
    struct lumi_lamp_mark *marks; /* of every turn, and of the last one's end; score 0: not known */
    float *sound;
    int sound_count;
    /* The second time through: pictures are stored as they come by. */
    int next;         /* index of the picture that comes next */
    int ready;        /* shot whose picture is encoded, −1: none */
    uint8_t *encoded; /* lumi_free */
    size_t encoded_size;
};

/* Videos: looked through, laid over the sweep, findings made. */
int ingest_films(struct ingest *ingest, struct lumi_error *error);
void ingest_film_finish(struct ingest_film *film);
int ingest_store_picture(struct ingest *ingest, struct lumi_capture *capture, int camera, int shot, int64_t frame,
                         struct lumi_error *error);

#endif
