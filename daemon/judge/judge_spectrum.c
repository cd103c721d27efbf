/* What a picture's spectrum says of it. Parts of the picture are transformed one by one; their log power is averaged,
 * so that what the place looks like averages out and what lens and motion did to all of them stays.
 *
 * 1. Pictures of places have amplitudes that fall with one over the frequency (Field, "Relations between the statistics
 * of natural images and the response properties of cortical cells", 1987). Sharpness is how much of that is left at
 *    high frequencies.
 * 2. A smear of constant speed multiplies the spectrum by sinc(L f·d): dark stripes across the direction d, 1/L apart
 *    (Cannon, "Blind deconvolution of spatially invariant image blurs with phase", 1976). What a place and a lens do to
 * the log power is smooth: constants, logarithm and powers of the frequency, and a slow dependence on direction. These
 * are taken out by least squares; the stripes that explain most of what is left, give length and direction.
 * 3. Frequencies at which noise drowns the picture do not count.
 * 4. A thing with two parallel edges makes the same stripes, and many edges along one direction the beginning of them,
 *    which matters most in small pictures. So a ridge along the stripes' own direction is taken out before they are
 *    looked for, and every quarter of the picture must have them. */
#include "daemon/judge/judge_priv.h"
#include "proto/base/memory.h"

#include <string.h>

#define PART_MOST 128 /* side of a part; smaller in small pictures, so that there are some beside each other */
#define PART_LEAST 32
#define BINS_MOST (PART_MOST / 2 * PART_MOST)
#define PARTS_X 6
#define PARTS_Y 4
#define GROUPS 4 /* quarters of the picture */
#define BASES 12
#define ANGLES 60
#define LENGTHS 70
#define LENGTH_LEAST 1.6
#define LENGTH_RATIO 1.04   /* 1.6 .. 24 pixels */
#define LENGTH_SHARE 0.1875 /* of a part: longer smears have stripes too close to be told apart */
#define PROFILE 96          /* samples of a profile over frequencies −0.5·√2 .. 0.5·√2, by magnitude */
#define F_LOW 0.04
#define F_HIGH 0.47

#define SHARP_LOW 0.03 /* the bands that sharpness compares, cycles a pixel */
#define SHARP_MID 0.08
#define SHARP_FROM 0.20
#define SHARP_TO 0.35

/* Thresholds, set on pictures whose truth is known (docs/judgement.md): the share of the residual that the stripes
 * explain, and how deep they are against what theory says, altogether and in each quarter where there is something to
 * be seen. */
#define EXPLAINED_LEAST 0.14
#define DEPTH_LEAST 0.15
#define GROUP_DEPTH_LEAST 0.1

struct work {
    int part, half, bins; /* side of a part, half of it, their product */
    float re[PART_MOST * PART_MOST], im[PART_MOST * PART_MOST];
    float window[PART_MOST];
    float power[BINS_MOST];               /* of one part */
    float log_power[BINS_MOST];           /* mean over parts */
    float group_power[GROUPS][BINS_MOST]; /* the same, of a quarter's parts */
    int group_parts[GROUPS];
    float base[BASES][BINS_MOST];       /* orthonormal over the bins that count */
    float f[BINS_MOST], phi[BINS_MOST]; /* frequency: magnitude, direction */
    uint8_t counts[BINS_MOST];
    float sharp[PARTS_X * PARTS_Y];
    float profile[PROFILE], number[PROFILE], base_profile[BASES][PROFILE];
    float stripes[LENGTHS][PROFILE], ridge[PROFILE];
    int parts;
};

static void prepare(struct work *work, int part)
{
    work->part = part;
    work->half = part / 2;
    work->bins = work->half * part;
    for (int i = 0; i < work->part; i++)
        work->window[i] = (float)(0.5 - 0.5 * cos(2 * LUMI_PI * (i + 0.5) / work->part));
    for (int v = 0; v < work->part; v++)
        for (int u = 0; u < work->half; u++) {
            double fx = (double)u / work->part, fy = (double)(v < work->half ? v : v - work->part) / work->part;
            work->f[v * work->half + u] = (float)hypot(fx, fy);
            work->phi[v * work->half + u] = (float)atan2(fy, fx);
        }
}

/* Power of the part at x0, y0, a unit a pixel of noise of variance 1. False: nothing to be seen in it. */
static bool transform(struct work *work, const struct judge_plane *plane, int x0, int y0)
{
    double mean = 0, clipped = 0;

    for (int y = 0; y < work->part; y++)
        for (int x = 0; x < work->part; x++) {
            float value = plane->data[(size_t)(y0 + y) * (size_t)plane->width + (size_t)(x0 + x)];
            mean += (double)value;
            clipped += value >= 0.98f;
        }
    mean /= work->part * work->part;
    if (clipped > 0.1 * work->part * work->part)
        return false;
    for (int y = 0; y < work->part; y++)
        for (int x = 0; x < work->part; x++) {
            float value = plane->data[(size_t)(y0 + y) * (size_t)plane->width + (size_t)(x0 + x)];
            work->re[y * work->part + x] = (value - (float)mean) * work->window[x] * work->window[y];
            work->im[y * work->part + x] = 0;
        }
    for (int y = 0; y < work->part; y++)
        judge_fft(work->re + y * work->part, work->im + y * work->part, work->part);
    float unit = 1.0f / (0.375f * 0.375f * work->part * work->part); /* the sum of the squared window */
    for (int x = 0; x < work->half; x++) {
        float re[PART_MOST], im[PART_MOST];
        for (int y = 0; y < work->part; y++) {
            re[y] = work->re[y * work->part + x];
            im[y] = work->im[y * work->part + x];
        }
        judge_fft(re, im, work->part);
        for (int y = 0; y < work->part; y++)
            work->power[y * work->half + x] = (re[y] * re[y] + im[y] * im[y]) * unit;
    }
    return true;
}

/* Mean of power × f² in a band: constant where amplitudes fall with 1/f. */
static double band(const struct work *work, double low, double high, double noise)
{
    double sum = 0;
    int count = 0;

    for (int i = 0; i < work->bins; i++) {
        double f = (double)work->f[i];
        if (f < low || f >= high || i % work->half == 0)
            continue;
        sum += fmax((double)work->power[i] - noise, 0) * f * f;
        count++;
    }
    return count ? sum / count : 0;
}

static void add_part(struct work *work, double noise, int group)
{
    double low = band(work, SHARP_LOW, SHARP_MID, noise), high = band(work, SHARP_FROM, SHARP_TO, noise);

    if (low < 30 * noise * SHARP_MID * SHARP_MID || low < 1e-9)
        return; /* a wall without anything on it */
    work->sharp[work->parts++] = (float)sqrt(high / low);
    work->group_parts[group]++;
    for (int i = 0; i < work->bins; i++) {
        float value = logf(work->power[i] + 1e-12f);
        work->log_power[i] += value;
        work->group_power[group][i] += value;
    }
}

/* The upper quartile: what is sharpest counts, as the place has parts without detail. */
static double quartile(float *values, int count)
{
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && values[k] < values[k - 1]; k--) {
            float swap = values[k];
            values[k] = values[k - 1];
            values[k - 1] = swap;
        }
    return count ? (double)values[(3 * (count - 1)) / 4] : 0;
}

/* Which bins count: between F_LOW and F_HIGH, off the axes (edges of parts, lines of sensors), where the mean over all
 * directions stands clear of the noise. */
static int choose_bins(struct work *work, double noise)
{
    double ring[PART_MOST / 2] = {0};
    int number[PART_MOST / 2] = {0}, chosen = 0;

    for (int i = 0; i < work->bins; i++) {
        int r = (int)(work->f[i] * work->part);
        if (r < work->half) {
            ring[r] += (double)work->log_power[i];
            number[r]++;
        }
    }
    for (int i = 0; i < work->bins; i++) {
        int r = (int)(work->f[i] * work->part), u = i % work->half, v = i / work->half;
        bool inside = (double)work->f[i] >= F_LOW && (double)work->f[i] <= F_HIGH && r < work->half;
        bool axis = u < 2 || v < 2 || v > work->part - 2;
        work->counts[i] = inside && !axis && number[r] > 0 && ring[r] / number[r] > log(2 * noise + 1e-12);
        chosen += work->counts[i];
    }
    return chosen;
}

static double dot(const struct work *work, const float *a, const float *b)
{
    double sum = 0;

    for (int i = 0; i < work->bins; i++)
        if (work->counts[i])
            sum += (double)(a[i] * b[i]);
    return sum;
}

static void take_bases_out(const struct work *work, float *values)
{
    for (int k = 0; k < BASES; k++) {
        float c = (float)dot(work, values, work->base[k]);
        for (int i = 0; i < work->bins; i++)
            values[i] -= c * work->base[k][i];
    }
}

/* The smooth part, made orthonormal (Gram and Schmidt, twice for accuracy), and taken out of the log power. */
static void take_smooth_out(struct work *work)
{
    for (int i = 0; i < work->bins; i++) {
        double f = (double)work->f[i], phi = (double)work->phi[i];
        const double values[BASES] = {
            1, log(f + 1e-3), f, f * f, cos(2 * phi), sin(2 * phi), cos(4 * phi), log(f + 1e-3) * cos(2 * phi),
            log(f + 1e-3) * sin(2 * phi), log(f + 1e-3) * cos(4 * phi),
            /* walls, shelves and horizons: a ridge along either axis */
            log(fabs(f * cos(phi)) + 1.0 / work->part), log(fabs(f * sin(phi)) + 1.0 / work->part)};
        for (int k = 0; k < BASES; k++)
            work->base[k][i] = (float)values[k];
    }
    for (int k = 0; k < BASES; k++) {
        for (int pass = 0; pass < 2; pass++)
            for (int j = 0; j < k; j++) {
                float c = (float)dot(work, work->base[k], work->base[j]);
                for (int i = 0; i < work->bins; i++)
                    work->base[k][i] -= c * work->base[j][i];
            }
        double length = sqrt(dot(work, work->base[k], work->base[k]));
        float scale = length > 1e-6 ? (float)(1 / length) : 0;
        for (int i = 0; i < work->bins; i++)
            work->base[k][i] *= scale;
    }
    take_bases_out(work, work->log_power);
}

static double stripe_length(int index)
{
    return LENGTH_LEAST * pow(LENGTH_RATIO, index);
}

/* Log of sinc² over what a bin's window lets in, never quite zero. */
static void make_stripes(struct work *work)
{
    for (int s = 0; s < PROFILE; s++)
        work->ridge[s] = logf((float)s / PROFILE * 0.5f + 1.0f / (float)work->part);
    for (int l = 0; l < LENGTHS; l++)
        for (int s = 0; s < PROFILE; s++) {
            double sum = 0;
            for (int k = -3; k <= 3; k++) {
                double x = LUMI_PI * stripe_length(l) * (s / (double)PROFILE * 0.5 + k * 0.4 / work->part);
                double sinc = fabs(x) < 1e-9 ? 1 : sin(x) / x;
                sum += sinc * sinc / 7;
            }
            work->stripes[l][s] = (float)log(sum + 0.002);
        }
}

/* Which sample of a profile along the direction c, s a bin is part of. */
static int profile_at(const struct work *work, int bin, float c, float s)
{
    int u = bin % work->half, v = bin / work->half;
    float along = fabsf((float)u * c + (float)(v < work->half ? v : v - work->part) * s);
    int at = (int)(along * (2.0f * PROFILE / (float)work->part) + 0.5f);

    return at < PROFILE ? at : PROFILE - 1;
}

/* Everything as a function of the frequency along one direction. */
static void make_profiles(struct work *work, double angle)
{
    float c = (float)cos(angle), s = (float)sin(angle);

    memset(work->profile, 0, sizeof work->profile);
    memset(work->number, 0, sizeof work->number);
    memset(work->base_profile, 0, sizeof work->base_profile);
    for (int i = 0; i < work->bins; i++) {
        if (!work->counts[i])
            continue;
        int at = profile_at(work, i, c, s);
        work->profile[at] += work->log_power[i];
        work->number[at] += 1;
        for (int k = 0; k < BASES; k++)
            work->base_profile[k][at] += work->base[k][i];
    }
}

static double profile_square(const struct work *work, const float *a)
{
    double sum = 0;

    for (int s = 0; s < PROFILE; s++)
        sum += (double)(work->number[s] * a[s] * a[s]);
    return sum;
}

struct fit {
    double score, depth, length, angle;
    int index;
};

/* The product of two profiles that are functions of the frequency along the direction at hand, without the smooth part.
 */
static double profile_dot(const struct work *work, const float *a, const float *b)
{
    double sum = 0;

    for (int s = 0; s < PROFILE; s++)
        sum += (double)(work->number[s] * a[s] * b[s]);
    for (int k = 0; k < BASES; k++) {
        double x = 0, y = 0;
        for (int s = 0; s < PROFILE; s++) {
            x += (double)(work->base_profile[k][s] * a[s]);
            y += (double)(work->base_profile[k][s] * b[s]);
        }
        sum -= x * y;
    }
    return sum;
}

/* The best length for the profiles at hand. Score: the squares that the stripes explain beyond what a ridge does: that
 * is straight edges along the direction, where a place has many of them. */
static void fit_length(const struct work *work, double angle, struct fit *best)
{
    double ridge_power = 0, ridge = profile_dot(work, work->ridge, work->ridge);
    bool has_ridge = ridge > 0.01 * profile_square(work, work->ridge);

    for (int s = 0; s < PROFILE; s++)
        ridge_power += (double)(work->profile[s] * work->ridge[s]);
    for (int l = 0; l < LENGTHS && stripe_length(l) <= LENGTH_SHARE * work->part; l++) {
        double along = 0, own = profile_dot(work, work->stripes[l], work->stripes[l]);
        for (int s = 0; s < PROFILE; s++)
            along += (double)(work->profile[s] * work->stripes[l][s]);
        if (has_ridge) {
            double share = profile_dot(work, work->ridge, work->stripes[l]) / ridge;
            along -= share * ridge_power;
            own -= share * share * ridge;
        }
        if (along <= 0 || own < 1e-2 * profile_square(work, work->stripes[l]))
            continue;
        double score = along * along / own;
        if (score > best->score)
            *best = (struct fit){score, along / own, stripe_length(l), angle, l};
    }
}

/* How deep the stripes are in one quarter of the picture. */
static double depth_in_group(struct work *work, int group, const struct fit *fit)
{
    float *power = work->group_power[group], *stripes = work->re, *ridge = work->im;
    float c = (float)cos(fit->angle), s = (float)sin(fit->angle);

    for (int i = 0; i < work->bins; i++) {
        int at = profile_at(work, i, c, s);
        power[i] /= (float)work->group_parts[group];
        stripes[i] = work->stripes[fit->index][at];
        ridge[i] = work->ridge[at];
    }
    take_bases_out(work, power);
    double all = dot(work, ridge, ridge);
    take_bases_out(work, stripes);
    take_bases_out(work, ridge);
    double left = dot(work, ridge, ridge);
    if (left > 0.01 * all) {
        float share = (float)(dot(work, ridge, stripes) / left);
        for (int i = 0; i < work->bins; i++)
            stripes[i] -= share * ridge[i];
    }
    double own = dot(work, stripes, stripes);
    return own > 1e-3 ? dot(work, power, stripes) / own : 0;
}

static void find_smear(struct work *work, struct lumi_judge_picture *picture)
{
    struct fit best = {0};

    take_smooth_out(work);
    make_stripes(work);
    double left = dot(work, work->log_power, work->log_power);
    for (int a = 0; a < ANGLES; a++) {
        make_profiles(work, LUMI_PI * a / ANGLES);
        fit_length(work, LUMI_PI * a / ANGLES, &best);
    }
    double coarse = best.angle;
    for (int a = -2; a <= 2; a++) {
        double angle = coarse + LUMI_PI * a / (3 * ANGLES);
        make_profiles(work, angle);
        fit_length(work, angle, &best);
    }
    picture->blur_explained = left > 0 ? best.score / left : 0;
    picture->blur_depth = best.depth;
    picture->blur_length = best.length;
    picture->blur_angle = best.angle - LUMI_PI * floor(best.angle / LUMI_PI);
    bool everywhere = true;
    for (int g = 0; g < GROUPS; g++) {
        picture->blur_groups[g] = work->group_parts[g] ? depth_in_group(work, g, &best) : (double)NAN;
        everywhere = everywhere && !(picture->blur_groups[g] < GROUP_DEPTH_LEAST);
    }
    if (picture->blur_explained >= EXPLAINED_LEAST && best.depth >= DEPTH_LEAST && everywhere)
        picture->blur_pixels = best.length;
}

int judge_spectrum(const struct judge_plane *plane, double noise, struct lumi_judge_picture *picture)
{
    double variance = noise * noise;

    int shorter = plane->width < plane->height ? plane->width : plane->height, part = PART_MOST;

    while (part > PART_LEAST && shorter < 2 * part)
        part /= 2;
    if (shorter < part)
        return LUMI_OK; /* too small to say */
    struct work *work = lumi_calloc(1, sizeof *work);
    if (!work)
        return LUMI_ERR_NOMEM;
    prepare(work, part);
    for (int j = 0; j < PARTS_Y; j++)
        for (int i = 0; i < PARTS_X; i++)
            if (transform(work, plane, (plane->width - work->part) * i / (PARTS_X - 1),
                          (plane->height - work->part) * j / (PARTS_Y - 1)))
                add_part(work, variance, j / (PARTS_Y / 2) * 2 + i / (PARTS_X / 2));
    picture->sharpness = quartile(work->sharp, work->parts);
    if (work->parts >= 3) {
        for (int i = 0; i < work->bins; i++)
            work->log_power[i] /= (float)work->parts;
        if (choose_bins(work, variance) > work->bins / 20)
            find_smear(work, picture);
    }
    lumi_free(work);
    return LUMI_OK;
}
