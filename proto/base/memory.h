/* The one seam through which the tree allocates, so that tests can make it fail. */
#ifndef LUMI_PROTO_BASE_MEMORY_H
#define LUMI_PROTO_BASE_MEMORY_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* As calloc(count, size), malloc(count * size) and realloc, with the product checked; memory is released with
 * lumi_free, which accepts NULL. All of it is aligned to 64 bytes, except what lumi_realloc returns (16). */
void *lumi_calloc(size_t count, size_t size);
void *lumi_alloc(size_t count, size_t size);
void lumi_free(void *memory);

/* For arrays that grow. Give it only NULL or what it returned itself; release with lumi_free. */
void *lumi_realloc(void *memory, size_t count, size_t size);

/* Tests: the allocation after `successes` further ones fails, and every one after it; a negative number never fails. */
void lumi_alloc_fail_after(long successes);

#ifdef __cplusplus
}
#endif
#endif
