/* Places: where every picture of a light field was taken, through which lens, and what becomes of it. What calibration
 * and the choice of views hand on. docs/pipeline.md has the format.
 *
 * A text file: the line "lumi places 1"; "lens MODEL WIDTH HEIGHT fx fy cx cy k1 k2 k3 k4 p1 p2" a lens; "view NAME
 * LENS FLAGS r11 r12 r13 t1 r21 … t3" a picture, row by row camera to world, metres; after a view's numbers the rest of
 * the line says why it is not used. FLAGS are letters: u used, k kept, s synthetic, m masked, or - for none. Numbers
 * have 17 digits: reading gives what was written. */
#ifndef LUMI_PIPELINE_RUN_PLACES_H
#define LUMI_PIPELINE_RUN_PLACES_H

#include "proto/base/lens.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

#define LUMI_PLACES_MAX 100000 /* views, and lenses */

struct lumi_place {
    char name[64]; /* the frame's; of a synthetic view, unique among all */
    int lens;      /* index */
    struct lumi_pose pose;
    bool used;      /* its picture is good, its pose is known (a synthetic one: always) */
    bool kept;      /* becomes a view of the field; otherwise other views are only made better by it */
    bool synthetic; /* nobody took it */
    bool masked;    /* parts of its picture are not of the place: rig, stand; to be filled in */
    char why[128];  /* why it is not used; "" */
};

struct lumi_places {
    int lens_count, count;
    struct lumi_lens *lenses; /* one allocation each */
    struct lumi_place *items;
};

/* An all-zero list is empty; released with lumi_places_finish. LUMI_ERR_NOMEM. A lens that is there already is found
 * again, so that equal lenses have equal indices. Returns the index in *lens. */
int lumi_places_add_lens(struct lumi_places *places, const struct lumi_lens *lens, int *index,
                         struct lumi_error *error);
int lumi_places_add(struct lumi_places *places, const struct lumi_place *place, struct lumi_error *error);
void lumi_places_finish(struct lumi_places *places);
/* −1: there is none. Linear; for tables make your own. */
int lumi_places_find(const struct lumi_places *places, const char *name);

/* Parsing trusts nothing; `source` stands for the file in errors. */
int lumi_places_parse(const char *text, size_t size, const char *source, struct lumi_places *places,
                      struct lumi_error *error);
int lumi_places_read(const char *path, struct lumi_places *places, struct lumi_error *error);
int lumi_places_write(const char *path, const struct lumi_places *places, struct lumi_error *error);

#endif
