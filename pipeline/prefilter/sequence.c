/* Points spread evenly. */
#include "pipeline/prefilter/sequence.h"

#define BITS 32

static uint32_t reversed(uint32_t x)
{
    x = x << 16 | x >> 16;
    x = (x & 0x00ff00ff) << 8 | (x & 0xff00ff00) >> 8;
    x = (x & 0x0f0f0f0f) << 4 | (x & 0xf0f0f0f0) >> 4;
    x = (x & 0x33333333) << 2 | (x & 0xcccccccc) >> 2;
    return (x & 0x55555555) << 1 | (x & 0xaaaaaaaa) >> 1;
}

/* A permutation of each bit that depends on the bits below it (Laine and Karras). */
static uint32_t permuted(uint32_t x, uint32_t seed)
{
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
}

static uint32_t mixed(uint32_t x)
{
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

/* Direction numbers, from a primitive polynomial's degree and coefficients and the first odd numbers. */
static void directions(int degree, uint32_t polynomial, const uint32_t *first, uint32_t v[BITS])
{
    for (int i = 0; i < BITS; i++) {
        if (i < degree) {
            v[i] = first[i] << (BITS - 1 - i);
            continue;
        }
        v[i] = v[i - degree] ^ v[i - degree] >> degree;
        for (int k = 1; k < degree; k++)
            if (polynomial >> (degree - 1 - k) & 1)
                v[i] ^= v[i - k];
    }
}

static uint32_t sobol(int dimension, uint32_t index)
{
    static const uint32_t first[4][3] = {{0}, {1}, {1, 3}, {1, 3, 1}};
    static const uint32_t polynomial[4] = {0, 0, 1, 1};
    uint32_t v[BITS], x = 0;

    if (dimension == 0)
        return reversed(index);
    directions(dimension, polynomial[dimension], first[dimension], v);
    for (int i = 0; index >> i; i++)
        if (index >> i & 1)
            x ^= v[i];
    return x;
}

void prefilter_point(uint32_t seed, uint32_t index, double point[4])
{
    for (int d = 0; d < 4; d++) {
        uint32_t x = sobol(d, index);
        x = reversed(permuted(reversed(x), mixed(seed + (uint32_t)d * 0x9e3779b9u)));
        point[d] = x * 0x1p-32;
    }
}
