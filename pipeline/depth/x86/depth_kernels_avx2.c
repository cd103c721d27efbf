/* The kernels of matching for AVX2. */
#include "pipeline/depth/depth_kernels_priv.h"

#include <immintrin.h>

static inline __m256 axis_position(const struct mvs_axis *axis, __m256 tangent)
{
    if (axis->linear)
        return _mm256_add_ps(_mm256_set1_ps(axis->a[0]), _mm256_mul_ps(_mm256_set1_ps(axis->b[0]), tangent));
    __m256 cell = _mm256_mul_ps(_mm256_sub_ps(tangent, _mm256_set1_ps(axis->origin)), _mm256_set1_ps(axis->scale));
    /* max first: it returns its second operand, 0, for a NaN */
    cell = _mm256_max_ps(cell, _mm256_setzero_ps());
    cell = _mm256_min_ps(cell, _mm256_set1_ps(MVS_AXIS_CELLS - 1));
    __m256i i = _mm256_cvttps_epi32(cell);
    __m256 a = _mm256_i32gather_ps(axis->a, i, 4), b = _mm256_i32gather_ps(axis->b, i, 4);
    return _mm256_add_ps(a, _mm256_mul_ps(b, tangent));
}

/* Costs of eight planes, one in each 32-bit lane. */
static inline __m256i sweep_eight(const struct mvs_target *target, const __m256 a[3], __m256i colour, int k)
{
    const __m256 zero = _mm256_setzero_ps(), half = _mm256_set1_ps(0.5f);
    __m256 z = _mm256_add_ps(a[2], _mm256_loadu_ps(target->plane_z + k));
    __m256 scale = _mm256_div_ps(_mm256_set1_ps(1), z);
    __m256 tx = _mm256_mul_ps(_mm256_add_ps(a[0], _mm256_loadu_ps(target->plane_x + k)), scale);
    __m256 ty = _mm256_mul_ps(_mm256_add_ps(a[1], _mm256_loadu_ps(target->plane_y + k)), scale);
    __m256 x = _mm256_add_ps(axis_position(&target->x, tx), half);
    __m256 y = _mm256_add_ps(axis_position(&target->y, ty), half);
    __m256 inside = _mm256_cmp_ps(z, zero, _CMP_GT_OQ);
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(x, zero, _CMP_GE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(y, zero, _CMP_GE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(x, _mm256_set1_ps((float)target->width), _CMP_LT_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(y, _mm256_set1_ps((float)target->height), _CMP_LT_OQ));
    __m256i column = _mm256_cvttps_epi32(_mm256_and_ps(x, inside));
    __m256i row = _mm256_cvttps_epi32(_mm256_and_ps(y, inside));
    __m256i index = _mm256_add_epi32(_mm256_mullo_epi32(row, _mm256_set1_epi32(target->width)), column);
    __m256i other = _mm256_i32gather_epi32((const int *)target->pixels, index, 4);
    __m256i difference = _mm256_or_si256(_mm256_subs_epu8(colour, other), _mm256_subs_epu8(other, colour));
    __m256i sum = _mm256_madd_epi16(_mm256_maddubs_epi16(difference, _mm256_set1_epi8(1)), _mm256_set1_epi16(1));
    sum = _mm256_min_epi32(sum, _mm256_set1_epi32(MVS_COST_MAX));
    return _mm256_blendv_epi8(_mm256_set1_epi32(MVS_INVALID), sum, _mm256_castps_si256(inside));
}

static void sweep(const struct mvs_target *target, const float a[3], uint32_t colour, int planes, uint8_t *cost)
{
    const __m256 ray[3] = {_mm256_set1_ps(a[0]), _mm256_set1_ps(a[1]), _mm256_set1_ps(a[2])};
    const __m256i own = _mm256_set1_epi32((int)colour);

    for (int k = 0; k < planes; k += 16) {
        __m256i low = sweep_eight(target, ray, own, k), high = sweep_eight(target, ray, own, k + 8);
        __m256i words = _mm256_permute4x64_epi64(_mm256_packus_epi32(low, high), 0xd8);
        __m128i bytes = _mm_packus_epi16(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1));
        _mm_storeu_si128((__m128i *)(void *)(cost + k), bytes);
    }
}

const struct mvs_kernels mvs_kernels_avx2 = {sweep, path_step, combine};
