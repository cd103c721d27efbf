/* The rig's lamp in a video: at every turn mark it sends the turn's number as a code (firmware/core/lamp.h: a start
 * half bit, then 12 bits of number and 4 of check, each as on-off or off-on), and stays off otherwise. The begin of the
 * start half bit is the mark. */
#ifndef LUMI_PIPELINE_EXCHANGE_FILM_LAMP_H
#define LUMI_PIPELINE_EXCHANGE_FILM_LAMP_H

#include "proto/base/result.h"

struct lumi_lamp_mark {
    int number;
    double time;  /* of the mark, in the times of the curves */
    double light; /* how much brighter the lamp makes what sees it, 0 … 1 */
    double score; /* higher is surer */
};

/* Brightness over time: `count` moments, `curves` values a moment (blocks of the picture). */
struct lumi_lamp_curves {
    const double *times; /* rising, s */
    const float *values; /* moment by moment */
    int count, curves;
};

/* The code of every number in [first, last] in the curve that shows it best. marks[number − first]; score 0: it was not
 * found. `bit` in s. */
int lumi_lamp_find(const struct lumi_lamp_curves *curves, double bit, int first, int last, struct lumi_lamp_mark *marks,
                   struct lumi_error *error);

/* The code's 33 half bits, first in bit 0, as firmware/core/lamp.c sends them. */
unsigned long long lumi_lamp_code(unsigned number);

#endif
