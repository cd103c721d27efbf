/* Exposures of brackets, as reported and as asked for. */
#include "pipeline/hdr/brackets.h"

#include "proto/base/sort.h"

#include <math.h>

enum { ASKED = 501 }; /* images that the median is taken over, evenly from all */

/* Of one shot, in seconds at ISO 100; 0: not reported. A camera that says no sensitivity is taken to keep it. */
static double reported_exposure(const struct lumi_source *source, int part)
{
    bool iso = true;

    for (int i = 0; i < source->part_count; i++)
        iso = iso && source->parts[i].iso > 0;
    const struct lumi_source_part *p = &source->parts[part];
    double exposure = p->exposure_s * (iso ? p->iso / 100 : 1);
    return isfinite(exposure) && exposure > 1e-9 && exposure < 1e9 ? exposure : 0;
}

/* The exposures that at least half of the brackets were asked for. */
static void find_offsets(const struct lumi_run *run, struct lumi_brackets *brackets)
{
    double offsets[LUMI_SHOTS_MAX];
    int counts[LUMI_SHOTS_MAX], kinds = 0, images = 0;

    for (int i = 0; i < run->count; i++) {
        images += run->sources[i].part_count > 0;
        for (int k = 0; k < run->sources[i].part_count; k++) {
            double offset = run->sources[i].parts[k].exposure_offset;
            int at = 0;
            while (at < kinds && offsets[at] != offset)
                at++;
            if (at == LUMI_SHOTS_MAX)
                continue;
            if (at == kinds) {
                offsets[kinds] = offset;
                counts[kinds++] = 0;
            }
            counts[at]++;
        }
    }
    for (int i = 0; i < kinds; i++)
        if (2 * counts[i] >= images)
            brackets->offsets[brackets->offset_count++] = offsets[i];
    lumi_sort_doubles(brackets->offsets, brackets->offset_count);
}

void lumi_brackets_find(const struct lumi_run *run, struct lumi_brackets *brackets)
{
    double values[ASKED];
    int count = 0;

    *brackets = (struct lumi_brackets){.nominal = 1};
    for (int asked = 0; asked < ASKED && asked < run->count; asked++) {
        int i = run->count <= ASKED ? asked : (int)((long long)asked * run->count / ASKED);
        const struct lumi_source *source = &run->sources[i];
        if (source->part_count == 0)
            continue;
        int part = 0;
        for (int k = 1; k < source->part_count; k++)
            if (fabs(source->parts[k].exposure_offset) < fabs(source->parts[part].exposure_offset))
                part = k;
        double exposure = reported_exposure(source, part);
        if (exposure > 0)
            values[count++] = exposure * exp2(-source->parts[part].exposure_offset);
    }
    if (count > 0)
        brackets->nominal = lumi_sort_median(values, count);
    find_offsets(run, brackets);
}

void lumi_bracket_exposures(const struct lumi_source *source, const struct lumi_brackets *brackets, double *exposures,
                            bool *reported)
{
    bool differ = source->part_count < 2;

    *reported = true;
    for (int i = 0; i < source->part_count; i++) {
        exposures[i] = reported_exposure(source, i);
        *reported = *reported && exposures[i] > 0;
    }
    if (*reported)
        return;
    for (int i = 1; i < source->part_count; i++)
        differ = differ || source->parts[i].exposure_offset != source->parts[0].exposure_offset;
    for (int i = 0; i < source->part_count; i++)
        exposures[i] = differ ? brackets->nominal * exp2(source->parts[i].exposure_offset) : 0;
}
