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
 * 3. Frequencies at which noise drowns the picture do not count. */
#include "daemon/judge/judge_priv.h"
#include "proto/base/memory.h"

#include <string.h>

#define PART 128 /* side of a part */
#define HALF (PART / 2)
#define BINS (HALF * PART)
#define PARTS_X 6
#define PARTS_Y 4
#define BASES 12
#define ANGLES 60
#define LENGTHS 70
#define LENGTH_LEAST 1.6
#define LENGTH_RATIO 1.04 /* 1.6 .. 24 pixels */
#define PROFILE 96        /* samples of a profile over frequencies −0.5·√2 .. 0.5·√2, by magnitude */
#define F_LOW 0.04
#define F_HIGH 0.47

#define SHARP_LOW 0.03 /* the bands that sharpness compares, cycles a pixel */
#define SHARP_MID 0.08
#define SHARP_FROM 0.20
#define SHARP_TO 0.35

/* Thresholds, set on pictures whose truth is known (docs/judgement.md): the share of the residual that the stripes
 * explain, and how deep they are against what theory says. */
#define EXPLAINED_LEAST 0.14
#define DEPTH_LEAST 0.15

struct work {
    float re[PART * PART], im[PART * PART];
    float window[PART];
    float power[BINS];        /* of one part */
    float log_power[BINS];    /* mean over parts */
    float base[BASES][BINS];  /* orthonormal over the bins that count */
    float f[BINS], phi[BINS]; /* frequency: magnitude, direction */
    uint8_t counts[BINS];
    float sharp[PARTS_X * PARTS_Y];
    float profile[PROFILE], number[PROFILE], base_profile[BASES][PROFILE];
    float stripes[LENGTHS][PROFILE];
    int parts;
};

static void prepare(struct work *work)
{
    for (int i = 0; i < PART; i++)
        work->window[i] = (float)(0.5 - 0.5 * cos(2 * LUMI_PI * (i + 0.5) / PART));
    for (int v = 0; v < PART; v++)
        for (int u = 0; u < HALF; u++) {
            double fx = (double)u / PART, fy = (double)(v < HALF ? v : v - PART) / PART;
            work->f[v * HALF + u] = (float)hypot(fx, fy);
            work->phi[v * HALF + u] = (float)atan2(fy, fx);
        }
}

/* Power of the part at x0, y0, a unit a pixel of noise of variance 1. False: nothing to be seen in it. */
static bool transform(struct work *work, const struct judge_plane *plane, int x0, int y0)
{
    double mean = 0, clipped = 0;

    for (int y = 0; y < PART; y++)
        for (int x = 0; x < PART; x++) {
            float value = plane->data[(size_t)(y0 + y) * (size_t)plane->width + (size_t)(x0 + x)];
            mean += (double)value;
            clipped += value >= 0.98f;
        }
    mean /= PART * PART;
    if (clipped > 0.1 * PART * PART)
        return false;
    for (int y = 0; y < PART; y++)
        for (int x = 0; x < PART; x++) {
            float value = plane->data[(size_t)(y0 + y) * (size_t)plane->width + (size_t)(x0 + x)];
            work->re[y * PART + x] = (value - (float)mean) * work->window[x] * work->window[y];
            work->im[y * PART + x] = 0;
        }
    for (int y = 0; y < PART; y++)
        judge_fft(work->re + y * PART, work->im + y * PART, PART);
    float unit = 1.0f / (0.375f * 0.375f * PART * PART); /* the sum of the squared window */
    for (int x = 0; x < HALF; x++) {
        float re[PART], im[PART];
        for (int y = 0; y < PART; y++) {
            re[y] = work->re[y * PART + x];
            im[y] = work->im[y * PART + x];
        }
        judge_fft(re, im, PART);
        for (int y = 0; y < PART; y++)
            work->power[y * HALF + x] = (re[y] * re[y] + im[y] * im[y]) * unit;
    }
    return true;
}

/* Mean of power × f² in a band: constant where amplitudes fall with 1/f. */
static double band(const struct work *work, double low, double high, double noise)
{
    double sum = 0;
    int count = 0;

    for (int i = 0; i < BINS; i++) {
        double f = (double)work->f[i];
        if (f < low || f >= high || i % HALF == 0)
            continue;
        sum += fmax((double)work->power[i] - noise, 0) * f * f;
        count++;
    }
    return count ? sum / count : 0;
}

static void add_part(struct work *work, double noise)
{
    double low = band(work, SHARP_LOW, SHARP_MID, noise), high = band(work, SHARP_FROM, SHARP_TO, noise);

    if (low < 30 * noise * SHARP_MID * SHARP_MID || low < 1e-9)
        return; /* a wall without anything on it */
    work->sharp[work->parts++] = (float)sqrt(high / low);
    for (int i = 0; i < BINS; i++)
        work->log_power[i] += logf(work->power[i] + 1e-12f);
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
    double ring[HALF] = {0};
    int number[HALF] = {0}, chosen = 0;

    for (int i = 0; i < BINS; i++) {
        int r = (int)(work->f[i] * PART);
        if (r < HALF) {
            ring[r] += (double)work->log_power[i];
            number[r]++;
        }
    }
    for (int i = 0; i < BINS; i++) {
        int r = (int)(work->f[i] * PART), u = i % HALF, v = i / HALF;
        bool inside = (double)work->f[i] >= F_LOW && (double)work->f[i] <= F_HIGH && r < HALF;
        bool axis = u < 2 || v < 2 || v > PART - 2;
        work->counts[i] = inside && !axis && number[r] > 0 && ring[r] / number[r] > log(2 * noise + 1e-12);
        chosen += work->counts[i];
    }
    return chosen;
}

static double dot(const struct work *work, const float *a, const float *b)
{
    double sum = 0;

    for (int i = 0; i < BINS; i++)
        if (work->counts[i])
            sum += (double)(a[i] * b[i]);
    return sum;
}

/* The smooth part, made orthonormal (Gram and Schmidt, twice for accuracy), and taken out of the log power. */
static void take_smooth_out(struct work *work)
{
    for (int i = 0; i < BINS; i++) {
        double f = (double)work->f[i], phi = (double)work->phi[i];
        const double values[BASES] = {1, log(f + 1e-3), f, f * f, cos(2 * phi), sin(2 * phi), cos(4 * phi),
                                      log(f + 1e-3) * cos(2 * phi), log(f + 1e-3) * sin(2 * phi),
                                      log(f + 1e-3) * cos(4 * phi),
                                      /* walls, shelves and horizons: a ridge along either axis */
                                      log(fabs(f * cos(phi)) + 1.0 / PART), log(fabs(f * sin(phi)) + 1.0 / PART)};
        for (int k = 0; k < BASES; k++)
            work->base[k][i] = (float)values[k];
    }
    for (int k = 0; k < BASES; k++) {
        for (int pass = 0; pass < 2; pass++)
            for (int j = 0; j < k; j++) {
                float c = (float)dot(work, work->base[k], work->base[j]);
                for (int i = 0; i < BINS; i++)
                    work->base[k][i] -= c * work->base[j][i];
            }
        double length = sqrt(dot(work, work->base[k], work->base[k]));
        float scale = length > 1e-6 ? (float)(1 / length) : 0;
        for (int i = 0; i < BINS; i++)
            work->base[k][i] *= scale;
        float c = (float)dot(work, work->log_power, work->base[k]);
        for (int i = 0; i < BINS; i++)
            work->log_power[i] -= c * work->base[k][i];
    }
}

static double stripe_length(int index)
{
    return LENGTH_LEAST * pow(LENGTH_RATIO, index);
}

/* Log of sinc² over what a bin's window lets in, never quite zero. */
static void make_stripes(struct work *work)
{
    for (int l = 0; l < LENGTHS; l++)
        for (int s = 0; s < PROFILE; s++) {
            double sum = 0;
            for (int k = -3; k <= 3; k++) {
                double x = LUMI_PI * stripe_length(l) * (s / (double)PROFILE * 0.5 + k * 0.4 / PART);
                double sinc = fabs(x) < 1e-9 ? 1 : sin(x) / x;
                sum += sinc * sinc / 7;
            }
            work->stripes[l][s] = (float)log(sum + 0.002);
        }
}

/* Everything as a function of the frequency along one direction. */
static void make_profiles(struct work *work, double angle)
{
    float c = (float)cos(angle), s = (float)sin(angle);

    memset(work->profile, 0, sizeof work->profile);
    memset(work->number, 0, sizeof work->number);
    memset(work->base_profile, 0, sizeof work->base_profile);
    for (int v = 0; v < PART; v++)
        for (int u = 0; u < HALF; u++) {
            int i = v * HALF + u;
            if (!work->counts[i])
                continue;
            float along = fabsf((float)u * c + (float)(v < HALF ? v : v - PART) * s);
            int at = (int)(along * (2.0f * PROFILE / PART) + 0.5f);
            at = at < PROFILE ? at : PROFILE - 1;
            work->profile[at] += work->log_power[i];
            work->number[at] += 1;
            for (int k = 0; k < BASES; k++)
                work->base_profile[k][at] += work->base[k][i];
        }
}

struct fit {
    double score, depth, length, angle;
};

/* The best length for the profiles at hand. Score: the squares that the stripes explain. */
static void fit_length(const struct work *work, double angle, struct fit *best)
{
    for (int l = 0; l < LENGTHS; l++) {
        double along = 0, own = 0;
        for (int s = 0; s < PROFILE; s++) {
            along += (double)(work->profile[s] * work->stripes[l][s]);
            own += (double)(work->number[s] * work->stripes[l][s] * work->stripes[l][s]);
        }
        for (int k = 0; k < BASES; k++) {
            double c = 0;
            for (int s = 0; s < PROFILE; s++)
                c += (double)(work->base_profile[k][s] * work->stripes[l][s]);
            own -= c * c;
        }
        if (along <= 0 || own < 1e-3)
            continue;
        double score = along * along / own;
        if (score > best->score)
            *best = (struct fit){score, along / own, stripe_length(l), angle};
    }
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
    if (picture->blur_explained >= EXPLAINED_LEAST && best.depth >= DEPTH_LEAST)
        picture->blur_pixels = best.length;
}

int judge_spectrum(const struct judge_plane *plane, double noise, struct lumi_judge_picture *picture)
{
    double variance = noise * noise;

    if (plane->width < PART || plane->height < PART)
        return LUMI_OK; /* too small to say */
    struct work *work = lumi_calloc(1, sizeof *work);
    if (!work)
        return LUMI_ERR_NOMEM;
    prepare(work);
    for (int j = 0; j < PARTS_Y; j++)
        for (int i = 0; i < PARTS_X; i++)
            if (transform(work, plane, (plane->width - PART) * i / (PARTS_X - 1),
                          (plane->height - PART) * j / (PARTS_Y - 1)))
                add_part(work, variance);
    picture->sharpness = quartile(work->sharp, work->parts);
    if (work->parts >= 3) {
        for (int i = 0; i < BINS; i++)
            work->log_power[i] /= (float)work->parts;
        if (choose_bins(work, variance) > BINS / 20)
            find_smear(work, picture);
    }
    lumi_free(work);
    return LUMI_OK;
}
