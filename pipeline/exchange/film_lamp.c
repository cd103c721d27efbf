/* Codes of the lamp in curves of brightness. */
#include "pipeline/exchange/film_lamp.h"

#include <glib.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#define BITS 16
#define HALVES (1 + 2 * BITS)
#define EDGE 2         /* half bits before and behind the code that are looked at, too */
#define FAINTEST 0.002 /* light of a lamp that is one */
#define EVEN 0.35      /* of the mean: no bit is fainter */
#define REFINE 16      /* steps of a moment to which a mark is placed */

/* CRC-4-ITU (ITU-T G.704, 2.3.3.5): x⁴ + x + 1, most significant bit first. */
static unsigned check_of(unsigned number)
{
    unsigned rest = number << 4;

    for (int bit = 15; bit >= 4; bit--)
        if (rest >> bit & 1)
            rest ^= 0x13u << (bit - 4);
    return rest & 0xf;
}

unsigned long long lumi_lamp_code(unsigned number)
{
    unsigned word = (number & 0xfff) << 4 | check_of(number & 0xfff);
    unsigned long long code = 1;

    for (int i = 0; i < BITS; i++)
        code |= (word >> (BITS - 1 - i) & 1 ? 1ull : 2ull) << (1 + 2 * i);
    return code;
}

/* One curve added up over time, so that the mean of any stretch is one difference. A picture stands for the time from
 * midway to the one before to midway to the next: edges stay edges. */
struct sum {
    const double *borders; /* count + 1: where pictures begin and end */
    const double *values;  /* ∫ from borders[0] to borders[i] */
    int count, hint;
};

static double integral(struct sum *sum, double time)
{
    int i = sum->hint;

    while (i + 1 < sum->count && sum->borders[i + 1] <= time)
        i++;
    while (i > 0 && sum->borders[i] > time)
        i--;
    sum->hint = i;
    double width = sum->borders[i + 1] - sum->borders[i];
    return sum->values[i] + (time - sum->borders[i]) / width * (sum->values[i + 1] - sum->values[i]);
}

/* What a code that begins at `time` would say, and how well it does. */
static double read_code(struct sum *sum, double time, double half, int first, int last, struct lumi_lamp_mark *mark)
{
    double means[HALVES + 2 * EDGE], light = 0, least = INFINITY, most = 0;
    double before = integral(sum, time - EDGE * half);
    unsigned word = 0;

    for (int k = 0; k < HALVES + 2 * EDGE; k++) {
        double after = integral(sum, time + (k + 1 - EDGE) * half);
        means[k] = (after - before) / half;
        before = after;
    }
    const double *code = means + EDGE;
    for (int i = 0; i < BITS; i++) {
        double difference = code[1 + 2 * i] - code[2 + 2 * i];
        word = word << 1 | (difference > 0 ? 1u : 0u);
        light += fabs(difference) / BITS;
        least = fmin(least, fabs(difference));
        most = fmax(most, fabs(difference));
    }
    int number = (int)(word >> 4);
    bool last_on = !(word & 1);
    double start = code[0] - code[-1], end = code[HALVES - 1] - code[HALVES];
    if (number < first || number > last || check_of((unsigned)number) != (word & 0xf) || light < FAINTEST ||
        least < EVEN * light || most > 2 * light || start < 0.5 * light || fabs(code[-1] - code[-2]) > 0.5 * light ||
        fabs(end - (last_on ? light : 0)) > 0.5 * light || fabs(code[HALVES] - code[HALVES + 1]) > 0.5 * light)
        return 0;
    /* Between two half bits of one kind nothing changes: the sharper the edges, the better the place. */
    double score = light * fmin(least / light, start / light);
    *mark = (struct lumi_lamp_mark){number, time, light, score};
    return score;
}

/* Of the places at which the code reads, the one in whose middle it does: the score falls to both sides of it. */
static void refine(struct sum *sum, double half, int first, int last, double step, struct lumi_lamp_mark *mark)
{
    double begin = mark->time, weight = 0, sum_of_times = 0, best = 0;
    struct lumi_lamp_mark here, kept = *mark;

    for (int i = -REFINE; i <= REFINE; i++) {
        double time = begin + i * step / REFINE;
        double score = read_code(sum, time, half, first, last, &here);
        if (score <= 0 || here.number != mark->number)
            continue;
        if (score > best + 1e-9) {
            best = score;
            kept = here;
            weight = sum_of_times = 0;
        }
        if (score > best - 1e-9) {
            weight += 1;
            sum_of_times += time;
        }
    }
    if (weight > 0)
        kept.time = sum_of_times / weight;
    *mark = kept;
}

static void search_curve(const struct lumi_lamp_curves *curves, int curve, const double *borders, double *values,
                         double half, int first, int last, struct lumi_lamp_mark *marks)
{
    struct sum sum = {borders, values, curves->count, 0};
    double end = borders[curves->count] - (HALVES + EDGE) * half;

    values[0] = 0;
    for (int i = 0; i < curves->count; i++)
        values[i + 1] = values[i] + (double)curves->values[(size_t)i * (size_t)curves->curves + (size_t)curve] *
                                        (borders[i + 1] - borders[i]);
    for (int i = 1; i < curves->count && borders[i] <= end; i++) {
        struct lumi_lamp_mark mark;
        if (borders[i] < borders[0] + EDGE * half)
            continue;
        if (read_code(&sum, borders[i], half, first, last, &mark) <= 0)
            continue;
        refine(&sum, half, first, last, borders[i + 1] - borders[i], &mark);
        if (mark.score > marks[mark.number - first].score)
            marks[mark.number - first] = mark;
    }
}

int lumi_lamp_find(const struct lumi_lamp_curves *curves, double bit, int first, int last, struct lumi_lamp_mark *marks,
                   struct lumi_error *error)
{
    int count = curves->count;

    if (!(bit > 0) || first < 0 || last < first || last > 0xfff)
        return lumi_fail(error, LUMI_ERR_ARG, "lamp: bits of %g s, numbers %d to %d", bit, first, last);
    memset(marks, 0, sizeof *marks * (size_t)(last - first + 1));
    if (count < 2)
        return LUMI_OK;
    double *values = g_new(double, count + 1), *borders = g_new(double, count + 1);
    for (int i = 1; i < count; i++)
        borders[i] = (curves->times[i - 1] + curves->times[i]) / 2;
    borders[0] = 2 * curves->times[0] - borders[1];
    borders[count] = 2 * curves->times[count - 1] - borders[count - 1];
    for (int curve = 0; curve < curves->curves; curve++)
        search_curve(curves, curve, borders, values, bit / 2, first, last, marks);
    g_free(values);
    g_free(borders);
    return LUMI_OK;
}
