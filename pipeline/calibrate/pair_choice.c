/* Which pictures are matched with which: neighbours, by the poses that are known before. */
#include "pipeline/calibrate/pairs.h"

#include "proto/base/sort.h"

#include <glib.h>
#include <math.h>

/* Of each picture's eight directions the two nearest, then the nearest of all; and whoever chose it. */
enum { SECTORS = 8, CHOSEN = 10, CLOSE = 48 };

struct near {
    int index, sector;
    double distance;
};

/* Half of what it sees across; pictures that look further apart than this have little in common. */
static double half_view(const struct lumi_lens *lens)
{
    struct lumi_vec3 left, right;

    if (!lumi_lens_unproject(lens, 0, lens->cy, &left) || !lumi_lens_unproject(lens, lens->width, lens->cy, &right))
        return LUMI_PI / 4;
    return fmin(LUMI_PI / 3, acos(fmax(-1, fmin(1, lumi_dot(left, right)))) / 2);
}

static bool before(const struct near *a, const struct near *b)
{
    return a->distance != b->distance ? a->distance < b->distance : a->index < b->index;
}

/* The pictures nearest to `index` that look the same way, at most CLOSE. */
static int close_ones(const struct lumi_run *run, int index, double limit, struct near close[CLOSE])
{
    const struct lumi_pose *pose = &run->sources[index].prior;
    int count = 0;

    for (int i = 0; i < run->count; i++) {
        const struct lumi_pose *other = &run->sources[i].prior;
        const struct lumi_vec3 way = lumi_rotate_back(pose->r, lumi_sub(other->t, pose->t));
        struct near item = {i, 0, lumi_length(way)};
        if (i == index || lumi_dot(lumi_axis(pose, 2), lumi_axis(other, 2)) < limit ||
            (count == CLOSE && !before(&item, &close[CLOSE - 1])))
            continue;
        item.sector = (int)lround(atan2(way.y, way.x) / (2 * LUMI_PI) * SECTORS + SECTORS) % SECTORS;
        int at = count < CLOSE ? count++ : CLOSE - 1;
        for (; at > 0 && before(&item, &close[at - 1]); at--)
            close[at] = close[at - 1];
        close[at] = item;
    }
    return count;
}

static int choose(const struct lumi_run *run, int index, double limit, int chosen[CHOSEN])
{
    struct near close[CLOSE];
    const int count = close_ones(run, index, limit, close);
    int taken[SECTORS] = {0}, result = 0;
    bool used[CLOSE] = {false};

    for (int round = 1; round <= 3; round++)
        for (int i = 0; i < count && result < CHOSEN; i++)
            if (!used[i] && (round == 3 || taken[close[i].sector] < round)) {
                used[i] = true;
                taken[close[i].sector]++;
                chosen[result++] = close[i].index;
            }
    return result;
}

int lumi_pairs_choose(const struct lumi_run *run, int index, int **partners)
{
    const double limit = cos(half_view(&run->sources[index].lens));
    struct near close[CLOSE];
    const int count = close_ones(run, index, limit, close);
    int chosen[CHOSEN], back[CHOSEN], result = 0;
    const int own = choose(run, index, limit, chosen);

    *partners = g_new(int, CHOSEN + CLOSE);
    for (int i = 0; i < own; i++)
        (*partners)[result++] = chosen[i];
    for (int i = 0; i < count; i++) {
        const int others = choose(run, close[i].index, limit, back);
        bool chose = false, there = false;
        for (int k = 0; k < others; k++)
            chose = chose || back[k] == index;
        for (int k = 0; k < own; k++)
            there = there || chosen[k] == close[i].index;
        if (chose && !there)
            (*partners)[result++] = close[i].index;
    }
    lumi_sort_ints(*partners, result);
    return result;
}
