/* Files of cameras that record by themselves, against the exposures. Their times are those of a card (FAT: two
 * seconds), of a clock that somebody has set by hand: order is what can be trusted, time only finds the gaps. */
#include "daemon/engine/match.h"

#include <math.h>

/* Both in order: the nearest exposure within tolerance that is still free, never going back. */
static int assign(const int64_t *files_ns, int files, const int64_t *exposures_ns, int exposures, double offset_s,
                  double tolerance, int *pairs, double *missed)
{
    int next = 0, hits = 0;

    *missed = 0;
    for (int i = 0; i < files; i++) {
        double best = tolerance;
        int found = -1;
        for (int j = next; j < exposures; j++) {
            double away = (double)(exposures_ns[j] - files_ns[i]) * 1e-9 - offset_s;
            if (away > tolerance)
                break;
            if (fabs(away) <= best) {
                /* The first of equals: files of one second go to the exposures in their order. */
                if (found >= 0 && fabs(away) >= best)
                    continue;
                best = fabs(away);
                found = j;
            }
        }
        if (pairs)
            pairs[i] = found;
        if (found < 0)
            continue;
        *missed += best;
        hits++;
        next = found + 1;
    }
    return hits;
}

int lumi_match_files(const int64_t *files_ns, int files, const int64_t *exposures_ns, int exposures, double tolerance,
                     int *pairs, double *offset_s)
{
    double best_offset = 0, best_missed = INFINITY, missed, sum = 0;
    int best = 0;

    if (files == exposures) {
        for (int i = 0; i < files; i++) {
            pairs[i] = i;
            sum += (double)(exposures_ns[i] - files_ns[i]) * 1e-9;
        }
        if (offset_s)
            *offset_s = files ? sum / files : 0;
        return files;
    }
    /* The first files were of some exposure, if not all of them are strangers. */
    for (int i = 0; i < files && i < 8; i++)
        for (int j = 0; j < exposures; j++) {
            double offset = (double)(exposures_ns[j] - files_ns[i]) * 1e-9;
            int hits = assign(files_ns, files, exposures_ns, exposures, offset, tolerance, NULL, &missed);
            if (hits > best || (hits == best && missed < best_missed)) {
                best = hits;
                best_missed = missed;
                best_offset = offset;
            }
        }
    if (offset_s)
        *offset_s = best_offset;
    return assign(files_ns, files, exposures_ns, exposures, best_offset, tolerance, pairs, &missed);
}
