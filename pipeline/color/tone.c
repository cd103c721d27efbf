/* Tone mapping: the statistics, and the curves. */
#include "pipeline/color/tone.h"

#include <math.h>

#define GREY 0.18
#define PASSES 0.001

float lumi_luminance(const float rgb[3])
{
    return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]; /* ITU-R BT.709 */
}

void lumi_light_add(struct lumi_light *light, float luminance)
{
    if (!(luminance > 0) || !isfinite(luminance))
        return;
    double at = (log2((double)luminance) - LUMI_LIGHT_LEAST) * LUMI_LIGHT_FINE;
    if (!(at >= 0))
        return;
    int bin = at < LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE ? (int)at : LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE - 1;
    light->bins[bin]++;
    light->count++;
}

static double middle(int bin)
{
    return (bin + 0.5) / LUMI_LIGHT_FINE + LUMI_LIGHT_LEAST;
}

double lumi_light_average(const struct lumi_light *light)
{
    double sum = 0;

    for (int i = 0; i < LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE; i++)
        sum += (double)light->bins[i] * middle(i);
    return light->count ? exp2(sum / (double)light->count) : 0;
}

double lumi_light_most(const struct lumi_light *light, double share)
{
    long long over = 0;

    for (int i = LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE - 1; i >= 0; i--) {
        over += light->bins[i];
        if (over > 0 && (double)over >= share * (double)light->count)
            return exp2(middle(i) + 0.5 / LUMI_LIGHT_FINE);
    }
    return 0;
}

void lumi_tone_choose(const struct lumi_light *light, enum lumi_tone tone, double stops, struct lumi_tone_map *map)
{
    double average = lumi_light_average(light);

    *map = (struct lumi_tone_map){.tone = tone, .scale = exp2(stops), .white = 1};
    if (tone == LUMI_TONE_NONE || !(average > 0))
        return;
    map->scale *= GREY / average;
    map->white = fmax(1, map->scale * lumi_light_most(light, PASSES));
}

/* Hable's numbers: shoulder strength 0.15, linear strength 0.5, linear angle 0.1, toe 0.2, 0.02, 0.3. */
static double hable(double x)
{
    return (x * (0.15 * x + 0.1 * 0.5) + 0.2 * 0.02) / (x * (0.15 * x + 0.5) + 0.2 * 0.3) - 0.02 / 0.3;
}

static void reinhard(const struct lumi_tone_map *map, float rgb[3])
{
    const float light = lumi_luminance(rgb);

    if (!(light > 0)) {
        rgb[0] = rgb[1] = rgb[2] = 0;
        return;
    }
    const double l = (double)light * map->scale, shown = fmin(l * (1 + l / (map->white * map->white)) / (1 + l), 1);
    const float by = (float)(shown / (double)light), grey = (float)shown;
    const float most = fmaxf(rgb[0], fmaxf(rgb[1], rgb[2])) * by;
    /* Towards the grey of the same luminance until the strongest channel is white. */
    const float share = most > 1 ? (1 - grey) / (most - grey) : 1;
    for (int c = 0; c < 3; c++)
        rgb[c] = grey + share * (rgb[c] * by - grey);
}

void lumi_tone_apply(const struct lumi_tone_map *map, float rgb[3])
{
    if (map->tone == LUMI_TONE_REINHARD) {
        reinhard(map, rgb);
        return;
    }
    for (int c = 0; c < 3; c++) {
        double x = (double)rgb[c] * map->scale;
        /* The curve is steeper than 1 at first: with twice the light, as in the original, mid greys keep theirs. */
        rgb[c] = (float)(map->tone == LUMI_TONE_HABLE ? hable(2 * fmax(x, 0)) / hable(2 * map->white) : x);
    }
}
