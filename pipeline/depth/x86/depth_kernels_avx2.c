/* The kernels of matching for AVX2. */
#include "pipeline/depth/mvs_priv.h"

#include <immintrin.h>
#include <math.h>

static inline __m256 position(const struct mvs_axis *axis, const struct mvs_line *line, __m256 tangent)
{
    if (line->straight)
        return _mm256_add_ps(_mm256_set1_ps(line->a), _mm256_mul_ps(_mm256_set1_ps(line->b), tangent));
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

/* Where groups end, and of which of eight that is well inside the image: a bit each. */
static inline int eight_ends(const struct mvs_target *target, const struct mvs_ends *ends, const __m256 a[3], int e,
                             float *x, float *y)
{
    const __m256 half = _mm256_set1_ps(0.5f), margin = _mm256_set1_ps(0.125f);
    __m256 z = _mm256_add_ps(a[2], _mm256_loadu_ps(ends->z + e));
    __m256 scale = _mm256_div_ps(_mm256_set1_ps(1), z);
    scale = _mm256_blendv_ps(_mm256_set1_ps(NAN), scale, _mm256_cmp_ps(z, _mm256_setzero_ps(), _CMP_GT_OQ));
    __m256 tx = _mm256_mul_ps(_mm256_add_ps(a[0], _mm256_loadu_ps(ends->x + e)), scale);
    __m256 ty = _mm256_mul_ps(_mm256_add_ps(a[1], _mm256_loadu_ps(ends->y + e)), scale);
    __m256 at_x = _mm256_add_ps(position(&target->x, &ends->column, tx), half);
    __m256 at_y = _mm256_add_ps(position(&target->y, &ends->row, ty), half);
    _mm256_storeu_ps(x + e, at_x);
    _mm256_storeu_ps(y + e, at_y);
    __m256 inside = _mm256_cmp_ps(at_x, margin, _CMP_GE_OQ);
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_y, margin, _CMP_GE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_x, _mm256_set1_ps((float)target->width - 0.125f), _CMP_LT_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_y, _mm256_set1_ps((float)target->height - 0.125f), _CMP_LT_OQ));
    return _mm256_movemask_ps(inside);
}

/* Costs of a group, one in each 32-bit lane. */
static inline __m256i sweep_group(const struct mvs_target *target, const float *x, const float *y, __m256i colour,
                                  bool well_inside)
{
    const __m256 zero = _mm256_setzero_ps(), count = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
    const float step_x = (x[1] - x[0]) * (1.0f / MVS_GROUP), step_y = (y[1] - y[0]) * (1.0f / MVS_GROUP);
    __m256 at_x = _mm256_add_ps(_mm256_set1_ps(x[0]), _mm256_mul_ps(count, _mm256_set1_ps(step_x)));
    __m256 at_y = _mm256_add_ps(_mm256_set1_ps(y[0]), _mm256_mul_ps(count, _mm256_set1_ps(step_y)));
    __m256 inside = _mm256_castsi256_ps(_mm256_set1_epi32(-1));

    if (!well_inside) {
        inside = _mm256_cmp_ps(at_x, zero, _CMP_GE_OQ);
        inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_y, zero, _CMP_GE_OQ));
        inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_x, _mm256_set1_ps((float)target->width), _CMP_LT_OQ));
        inside = _mm256_and_ps(inside, _mm256_cmp_ps(at_y, _mm256_set1_ps((float)target->height), _CMP_LT_OQ));
        at_x = _mm256_and_ps(at_x, inside);
        at_y = _mm256_and_ps(at_y, inside);
    }
    __m256i column = _mm256_cvttps_epi32(at_x), row = _mm256_cvttps_epi32(at_y);
    __m256i index = _mm256_add_epi32(_mm256_mullo_epi32(row, _mm256_set1_epi32(target->width)), column);
    __m256i other = _mm256_i32gather_epi32((const int *)target->pixels, index, 4);
    __m256i difference = _mm256_or_si256(_mm256_subs_epu8(colour, other), _mm256_subs_epu8(other, colour));
    __m256i sum = _mm256_madd_epi16(_mm256_maddubs_epi16(difference, _mm256_set1_epi8(1)), _mm256_set1_epi16(1));
    sum = _mm256_min_epi32(sum, _mm256_set1_epi32(MVS_COST_MAX));
    return well_inside ? sum : _mm256_blendv_epi8(_mm256_set1_epi32(MVS_INVALID), sum, _mm256_castps_si256(inside));
}

static inline __m256i any_group(const struct mvs_target *target, const float *x, const float *y, __m256i colour,
                                uint64_t inside)
{
    if ((inside & 3) == 3)
        return sweep_group(target, x, y, colour, true);
    return sweep_group(target, x, y, colour, false);
}

static void sweep(const struct mvs_target *target, const struct mvs_ends *ends, const float a[3], uint32_t colour,
                  uint8_t *cost)
{
    const __m256 ray[3] = {_mm256_set1_ps(a[0]), _mm256_set1_ps(a[1]), _mm256_set1_ps(a[2])};
    const __m256i own = _mm256_set1_epi32((int)colour);
    float x[2 * MVS_GROUPS_MAX], y[2 * MVS_GROUPS_MAX];
    uint64_t inside = 0;

    for (int e = 0; e < ends->count; e += 8)
        inside |= (uint64_t)eight_ends(target, ends, ray, e, x, y) << e;
    for (int i = 0; i < ends->groups; i += 2) {
        const int e = ends->end[i], f = ends->end[i + 1];
        __m256i low = any_group(target, x + e, y + e, own, inside >> e);
        __m256i high = any_group(target, x + f, y + f, own, inside >> f);
        __m256i words = _mm256_permute4x64_epi64(_mm256_packus_epi32(low, high), 0xd8);
        __m128i bytes = _mm_packus_epi16(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1));
        _mm_storeu_si128((__m128i *)(void *)(cost + MVS_GROUP * i), bytes);
    }
}

static inline __m128i load(const uint8_t *bytes)
{
    return _mm_loadu_si128((const __m128i *)(const void *)bytes);
}

static inline void order(__m128i *a, __m128i *b)
{
    const __m128i low = _mm_min_epu8(*a, *b);

    *b = _mm_max_epu8(*a, *b);
    *a = low;
}

/* The four smallest of eight, ascending, in v[0..3]: both halves sorted, then the smaller of opposite ends (which are
 * the four smallest), sorted. */
static inline void four_smallest(__m128i v[LUMI_MVS_NEIGHBOURS])
{
    for (int i = 0; i < 8; i += 4) {
        order(&v[i], &v[i + 1]);
        order(&v[i + 2], &v[i + 3]);
        order(&v[i], &v[i + 2]);
        order(&v[i + 1], &v[i + 3]);
        order(&v[i + 1], &v[i + 2]);
    }
    for (int i = 0; i < 4; i++)
        v[i] = _mm_min_epu8(v[i], v[7 - i]);
    order(&v[0], &v[2]);
    order(&v[1], &v[3]);
    order(&v[0], &v[1]);
    order(&v[2], &v[3]);
}

/* The mean of 16 lanes' valid costs among the first `best`. */
static inline __m128i mean_valid(const __m128i v[4], int best)
{
    const __m128i invalid = _mm_set1_epi8((char)MVS_INVALID);
    /* 256 over the number of valid costs, by that number; 256 itself does not fit: one less, mended below. */
    const __m128i shares = _mm_setr_epi8(0, (char)255, (char)128, 85, 64, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    __m128i valid = _mm_setzero_si128();
    __m256i sum = _mm256_setzero_si256();

    for (int n = 0; n < best; n++) {
        __m128i bad = _mm_cmpeq_epi8(v[n], invalid);
        valid = _mm_add_epi8(valid, _mm_andnot_si128(bad, _mm_set1_epi8(1)));
        sum = _mm256_add_epi16(sum, _mm256_cvtepu8_epi16(_mm_andnot_si128(bad, v[n])));
    }
    __m256i share = _mm256_cvtepu8_epi16(_mm_shuffle_epi8(shares, valid));
    share = _mm256_sub_epi16(share, _mm256_cmpeq_epi16(share, _mm256_set1_epi16(255)));
    __m256i mean = _mm256_srli_epi16(_mm256_mullo_epi16(sum, share), 8);
    __m128i bytes = _mm_packus_epi16(_mm256_castsi256_si128(mean), _mm256_extracti128_si256(mean, 1));
    return _mm_blendv_epi8(bytes, _mm_set1_epi8(MVS_COST_MAX / 2), _mm_cmpeq_epi8(valid, _mm_setzero_si128()));
}

static void combine(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int lanes, uint8_t *result)
{
    for (int k = 0; k < lanes; k += MVS_LANES) {
        __m128i v[LUMI_MVS_NEIGHBOURS];
        for (int n = 0; n < LUMI_MVS_NEIGHBOURS; n++)
            v[n] = load(cost[n] + k);
        four_smallest(v);
        _mm_storeu_si128((__m128i *)(void *)(result + k), mean_valid(v, best));
    }
}

static inline int lowest_byte(__m128i bytes)
{
    __m128i words = _mm_min_epu8(bytes, _mm_srli_epi16(bytes, 8));

    words = _mm_and_si128(words, _mm_set1_epi16(255));
    return _mm_extract_epi16(_mm_minpos_epu16(words), 0);
}

static void step(struct mvs_step *s)
{
    __m128i lowest[MVS_PATHS], before[MVS_PATHS], jump[MVS_PATHS];

    for (int d = 0; d < MVS_PATHS; d++) {
        lowest[d] = _mm_set1_epi8(-1);
        before[d] = _mm_set1_epi8((char)s->lowest[d]);
        jump[d] = _mm_set1_epi8((char)(s->lowest[d] + s->p2[d]));
    }
    for (int k = 0; k < s->lanes; k += MVS_LANES) {
        const __m128i cost = load(s->cost + k), below = load(s->below + k), above = load(s->above + k);
        __m256i *sum = (__m256i *)(void *)(s->sum + k);
        __m256i total = s->add ? _mm256_loadu_si256(sum) : _mm256_setzero_si256();
        for (int d = 0; d < MVS_PATHS; d++) {
            const uint8_t *previous = s->previous[d] + k;
            __m128i best = _mm_min_epu8(load(previous), jump[d]);
            best = _mm_min_epu8(best, _mm_adds_epu8(load(previous - 1), below));
            best = _mm_min_epu8(best, _mm_adds_epu8(load(previous + 1), above));
            __m128i value = _mm_adds_epu8(cost, _mm_sub_epi8(best, before[d]));
            _mm_storeu_si128((__m128i *)(void *)(s->path[d] + k), value);
            total = _mm256_add_epi16(total, _mm256_cvtepu8_epi16(value));
            lowest[d] = _mm_min_epu8(lowest[d], value);
        }
        _mm256_storeu_si256(sum, total);
    }
    for (int d = 0; d < MVS_PATHS; d++)
        s->lowest[d] = lowest_byte(lowest[d]);
}

static int smallest(const uint16_t *sum, int lanes)
{
    int lowest = UINT16_MAX + 1, at = 0;

    for (int k = 0; k < lanes; k += 8) {
        __m128i found = _mm_minpos_epu16(_mm_loadu_si128((const __m128i *)(const void *)(sum + k)));
        int value = _mm_extract_epi16(found, 0);
        if (value < lowest) {
            lowest = value;
            at = k + _mm_extract_epi16(found, 1);
        }
    }
    return at;
}

const struct mvs_kernels mvs_kernels_avx2 = {sweep, combine, step, smallest};
