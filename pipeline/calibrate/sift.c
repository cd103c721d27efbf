/* SIFT by VLFeat. */
#include "pipeline/calibrate/sift.h"

#include "proto/base/memory.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <vl/sift.h>

/* Regions in which features compete, along the longer side. */
enum { REGIONS = 16, LEVELS = 3, OCTAVES_MAX = 6 };

struct candidate {
    VlSiftKeypoint key;
    float strength;
    int region, rank; /* rank: within its region, 0 the strongest */
    int order;        /* as VLFeat found it: the last word where all else is equal */
};

struct lumi_sift {
    VlSiftFilt *filter;
    int width, height, first_octave;
    struct candidate *candidates;
    int capacity;
};

void lumi_sift_defaults(struct lumi_sift_settings *settings)
{
    *settings = (struct lumi_sift_settings){.first_octave = 0, .most = 2000, .contrast = 1.2, .edge = 10};
}

struct lumi_sift *lumi_sift_create(void)
{
    return lumi_calloc(1, sizeof(struct lumi_sift));
}

void lumi_sift_destroy(struct lumi_sift *sift)
{
    if (!sift)
        return;
    if (sift->filter)
        vl_sift_delete(sift->filter);
    lumi_free(sift->candidates);
    lumi_free(sift);
}

/* A filter has tables that are the same for all; whoever makes one fills them. */
static VlSiftFilt *filter_new(int width, int height, int first_octave)
{
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    int octaves = 1 - first_octave;

    while (octaves - 1 < OCTAVES_MAX && (width < height ? width : height) >> (octaves + first_octave) >= 16)
        octaves++;
    pthread_mutex_lock(&lock);
    VlSiftFilt *filter = vl_sift_new(width, height, octaves, LEVELS, first_octave);
    pthread_mutex_unlock(&lock);
    return filter;
}

static int prepare(struct lumi_sift *sift, int width, int height, const struct lumi_sift_settings *settings)
{
    if (sift->filter && sift->width == width && sift->height == height && sift->first_octave == settings->first_octave)
        return LUMI_OK;
    if (sift->filter)
        vl_sift_delete(sift->filter);
    sift->filter = filter_new(width, height, settings->first_octave);
    if (!sift->filter)
        return LUMI_ERR_NOMEM;
    sift->width = width;
    sift->height = height;
    sift->first_octave = settings->first_octave;
    return LUMI_OK;
}

/* The difference of two blurs at a key point: how much it stands out. */
static float strength_of(const VlSiftFilt *filter, const VlSiftKeypoint *key)
{
    const size_t at =
        (size_t)key->iy * (size_t)vl_sift_get_octave_width(filter) + (size_t)key->ix; /* of the octave's level */

    return fabsf(vl_sift_get_octave(filter, key->is + 1)[at] - vl_sift_get_octave(filter, key->is)[at]);
}

static int by_strength(const void *left, const void *right)
{
    const struct candidate *a = left, *b = right;

    if (a->region != b->region)
        return a->region < b->region ? -1 : 1;
    if (a->strength != b->strength)
        return a->strength > b->strength ? -1 : 1;
    return a->order < b->order ? -1 : 1;
}

static int by_rank(const void *left, const void *right)
{
    const struct candidate *a = left, *b = right;

    if (a->rank != b->rank)
        return a->rank < b->rank ? -1 : 1;
    if (a->strength != b->strength)
        return a->strength > b->strength ? -1 : 1;
    return a->order < b->order ? -1 : 1;
}

/* The candidates of the octave the filter is at; those to be taken first come first. −1: no memory. */
static int collect(struct lumi_sift *sift, const struct lumi_sift_settings *settings)
{
    const VlSiftKeypoint *keys = vl_sift_get_keypoints(sift->filter);
    const int found = vl_sift_get_nkeypoints(sift->filter);
    const double side = (double)(sift->width > sift->height ? sift->width : sift->height) / REGIONS;
    int count = 0;

    if (found > sift->capacity) {
        struct candidate *more = lumi_realloc(sift->candidates, (size_t)found, sizeof *more);
        if (!more)
            return -1;
        sift->candidates = more;
        sift->capacity = found;
    }
    for (int i = 0; i < found; i++) {
        const int x = (int)(keys[i].x + 0.5f), y = (int)(keys[i].y + 0.5f);
        if (x < 0 || y < 0 || x >= sift->width || y >= sift->height ||
            (settings->use && !settings->use[(size_t)y * (size_t)sift->width + (size_t)x]))
            continue;
        sift->candidates[count++] = (struct candidate){.key = keys[i],
                                                       .strength = strength_of(sift->filter, &keys[i]),
                                                       .region = (int)(y / side) * REGIONS + (int)(x / side),
                                                       .order = i};
    }
    if (count == 0)
        return 0;
    qsort(sift->candidates, (size_t)count, sizeof *sift->candidates, by_strength);
    for (int i = 1; i < count; i++)
        if (sift->candidates[i].region == sift->candidates[i - 1].region)
            sift->candidates[i].rank = sift->candidates[i - 1].rank + 1;
    qsort(sift->candidates, (size_t)count, sizeof *sift->candidates, by_rank);
    return count;
}

static void describe(const float *floats, uint8_t *bytes)
{
    float sum = 0;

    for (int i = 0; i < LUMI_DESCRIPTOR_SIZE; i++)
        sum += floats[i];
    for (int i = 0; i < LUMI_DESCRIPTOR_SIZE; i++) {
        const float value = sum > 0 ? 512 * sqrtf(floats[i] / sum) + 0.5f : 0;
        bytes[i] = (uint8_t)(value > 255 ? 255 : value);
    }
}

/* The key points of an octave, best first, each with its main directions; returns how many features these are. */
static int describe_octave(struct lumi_sift *sift, int candidates, int room, struct lumi_feature *items)
{
    int count = 0;

    for (int i = 0; i < candidates && count < room; i++) {
        const VlSiftKeypoint *key = &sift->candidates[i].key;
        double angles[4];
        float descriptor[LUMI_DESCRIPTOR_SIZE];
        const int directions = vl_sift_calc_keypoint_orientations(sift->filter, angles, key);
        for (int d = 0; d < directions && d < 2 && count < room; d++) {
            struct lumi_feature *item = &items[count++];
            *item = (struct lumi_feature){key->x + 0.5f, key->y + 0.5f, key->sigma, (float)angles[d], {0}};
            vl_sift_calc_keypoint_descriptor(sift->filter, descriptor, key, angles[d]);
            describe(descriptor, item->descriptor);
        }
    }
    return count;
}

/* The root mean square of the first difference of blurs in the octave the filter is at (not a doubled one), of what is
 * used: the outline of the rest is sharp in any picture. */
static double band(const VlSiftFilt *filter, const uint8_t *use, int full_width)
{
    const int width = vl_sift_get_octave_width(filter), height = vl_sift_get_octave_height(filter);
    const int octave = vl_sift_get_octave_index(filter);
    const float *fine = vl_sift_get_octave(filter, 0), *coarse = vl_sift_get_octave(filter, 1);
    double sum = 0;
    long count = 0;

    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const size_t at = (size_t)y * (size_t)width + (size_t)x;
            if (use && !use[(size_t)(y << octave) * (size_t)full_width + (size_t)(x << octave)])
                continue;
            const double difference = (double)coarse[at] - (double)fine[at];
            sum += difference * difference;
            count++;
        }
    return count ? sqrt(sum / (double)count) : 0;
}

static int find(struct lumi_sift *sift, const float *grey, int width, const struct lumi_sift_settings *settings,
                struct lumi_feature *items, int *count, double bands[2])
{
    VlSiftFilt *filter = sift->filter;

    vl_sift_set_peak_thresh(filter, settings->contrast);
    vl_sift_set_edge_thresh(filter, settings->edge);
    for (int end = vl_sift_process_first_octave(filter, grey); !end; end = vl_sift_process_next_octave(filter)) {
        const int octave = vl_sift_get_octave_index(filter), left = settings->most - *count;
        const bool last = octave == vl_sift_get_octave_first(filter) + vl_sift_get_noctaves(filter) - 1;
        if (octave == 0 || octave == 1)
            bands[octave] = band(filter, settings->use, width);
        vl_sift_detect(filter);
        const int candidates = collect(sift, settings);
        if (candidates < 0)
            return LUMI_ERR_NOMEM;
        /* Every octave leaves something to those after it: large features are found from afar. */
        *count += describe_octave(sift, candidates, last ? left : left - left / 4, items + *count);
    }
    return LUMI_OK;
}

int lumi_sift_find(struct lumi_sift *sift, const float *grey, int width, int height,
                   const struct lumi_sift_settings *settings, struct lumi_feature **items, int *count, float *sharpness,
                   struct lumi_error *error)
{
    double bands[2] = {0, 0};

    *items = NULL;
    *count = 0;
    if (width < 16 || height < 16)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%d×%d pixels are too few to find anything in", width, height);
    struct lumi_feature *found = lumi_calloc((size_t)settings->most, sizeof *found);
    int code = found ? prepare(sift, width, height, settings) : LUMI_ERR_NOMEM;
    if (code == LUMI_OK)
        code = find(sift, grey, width, settings, found, count, bands);
    if (code != LUMI_OK) {
        lumi_free(found);
        *count = 0;
        return lumi_fail(error, code, "not enough memory to find features");
    }
    *items = found;
    *sharpness = (float)(bands[1] > 0 ? bands[0] / bands[1] : 0);
    return LUMI_OK;
}
