/* How two recordings of one event lie to each other in time, by what both saw or heard: the lag at which their curves
 * correlate most. */
#ifndef LUMI_PIPELINE_EXCHANGE_FILM_OFFSET_H
#define LUMI_PIPELINE_EXCHANGE_FILM_OFFSET_H

#include "proto/base/result.h"

struct lumi_film_offset {
    double seconds;     /* what is at time t of the first is at t + seconds of the second */
    double correlation; /* there, −1 … 1 */
    double next;        /* the highest elsewhere, half a second away at least */
};
/* Curves of `rate` values a second. What is slower than about two seconds is taken out of them first. LUMI_ERR_NOMEM.
 */
int lumi_film_find_offset(const float *first, int first_count, const float *second, int second_count, double rate,
                          struct lumi_film_offset *offset, struct lumi_error *error);

#endif
