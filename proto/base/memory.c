/* The allocation seam. */
#include "proto/base/memory.h"

#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static atomic_long left = -1;

static int refused(void)
{
    if (atomic_load_explicit(&left, memory_order_relaxed) < 0)
        return 0;
    long before = atomic_fetch_sub(&left, 1);
    if (before > 0)
        return 0;
    atomic_store(&left, 0);
    return 1;
}

void lumi_alloc_fail_after(long successes)
{
    atomic_store(&left, successes);
}

void *lumi_alloc(size_t count, size_t size)
{
    void *memory;

    if (refused() || (size && count > (PTRDIFF_MAX - 64) / size))
        return NULL;
    size_t bytes = count * size;
    bytes = (bytes + 63) & ~(size_t)63;
    if (posix_memalign(&memory, 64, bytes ? bytes : 64))
        return NULL;
    return memory;
}

void *lumi_calloc(size_t count, size_t size)
{
    void *memory = lumi_alloc(count, size);

    if (memory)
        memset(memory, 0, count * size);
    return memory;
}

void *lumi_realloc(void *memory, size_t count, size_t size)
{
    if (refused() || (size && count > (PTRDIFF_MAX - 64) / size))
        return NULL;
    size_t bytes = count * size;
    return realloc(memory, bytes ? bytes : 1);
}

void lumi_free(void *memory)
{
    free(memory);
}
