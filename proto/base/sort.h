/* Plain numbers in ascending order, and the one in their middle. NaN has no place in an order: none may be among them.
 */
#ifndef LUMI_PROTO_BASE_SORT_H
#define LUMI_PROTO_BASE_SORT_H

#ifdef __cplusplus
extern "C" {
#endif

void lumi_sort_doubles(double *values, int count);
void lumi_sort_floats(float *values, int count);
void lumi_sort_ints(int *values, int count);

/* Sorts, and returns what stands in the middle (of an even number, the greater of the two there); 0 of none. */
double lumi_sort_median(double *values, int count);

#ifdef __cplusplus
}
#endif
#endif
