/* Doing the same to many things on several threads, with a result that does not depend on how many. */
#ifndef LUMI_PROTO_BASE_PARALLEL_H
#define LUMI_PROTO_BASE_PARALLEL_H

#ifdef __cplusplus
extern "C" {
#endif

/* Item `index` of the loop, on thread `thread` (0 .. threads-1; for scratch memory a thread). Returns 0, or a negative
 * code, which ends the loop early. */
typedef int (*lumi_parallel_fn)(void *context, int index, int thread);

/* Calls fn for every index in [0, count), on up to `threads` threads (≤ 0: as many as the process may use), in any
 * order. Returns 0 or the code of the failed item with the lowest index among those that ran. Threads that cannot be
 * started are done without. */
int lumi_parallel_for(int count, int threads, lumi_parallel_fn fn, void *context);

/* The number of threads that `threads` ≤ 0 stands for. */
int lumi_thread_count(void);

#ifdef __cplusplus
}
#endif
#endif
