/* Sorting plain numbers: qsort with the comparison of each kind. */
#include "proto/base/sort.h"

#include <stdlib.h>

static int by_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

static int by_float(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;

    return (x > y) - (x < y);
}

static int by_int(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;

    return (x > y) - (x < y);
}

void lumi_sort_doubles(double *values, int count)
{
    if (count > 1)
        qsort(values, (size_t)count, sizeof *values, by_double);
}

void lumi_sort_floats(float *values, int count)
{
    if (count > 1)
        qsort(values, (size_t)count, sizeof *values, by_float);
}

void lumi_sort_ints(int *values, int count)
{
    if (count > 1)
        qsort(values, (size_t)count, sizeof *values, by_int);
}

double lumi_sort_median(double *values, int count)
{
    lumi_sort_doubles(values, count);
    return count > 0 ? values[count / 2] : 0;
}
