/* Which quality makes a field of a wanted size, with as little coding as can be. */
#ifndef LUMI_PIPELINE_COMPRESS_SIZE_SEARCH_H
#define LUMI_PIPELINE_COMPRESS_SIZE_SEARCH_H

#include "proto/base/result.h"

/* How large the field is at a quality, 0..100. */
typedef int (*compress_size_fn)(void *context, int quality, long long *size, struct lumi_error *error);

/* A quality whose field is no larger than `target` and, where quality 100 is not, smaller by a few percent at most; −1:
 * not even that of quality 0 is. `estimate` (NULL: there is none) is cheap and may be wrong by some share that hardly
 * changes with quality; `measure` is dear and right. Neither `estimate` nor anything but a measured size decides what
 * fits. What comes out depends on the sizes alone.
 *
 * Sizes grow about exponentially with quality, so their logarithm is interpolated between what is known (a secant that
 * keeps its bracket). */
int compress_size_search(long long target, compress_size_fn estimate, compress_size_fn measure, void *context,
                         int *quality, struct lumi_error *error);

#endif
