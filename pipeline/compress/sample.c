/* Coding a sample. */
#include "pipeline/compress/sample.h"

#include "pipeline/compress/level.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <glib/gstdio.h>

enum { CLUSTER_SHARE = 3, MEMBER_SHARE = 4, MEMBERS = 2, PAYS = 3, VIEW_BYTES = 106 /* in the index */ };

static int kept_clusters(int count)
{
    return (count + CLUSTER_SHARE - 1) / CLUSTER_SHARE;
}

/* Of `count` images with the same reference. */
static int kept_members(int count)
{
    int share = (count + MEMBER_SHARE - 1) / MEMBER_SHARE;

    return MIN(count, MAX(share, MEMBERS));
}

/* The `i`-th of `taken` numbers spread evenly over [0, count). */
static int spread(int i, int taken, int count)
{
    return (int)((2L * i + 1) * count / (2L * taken));
}

bool compress_sample_pays(int view_count, int cluster_size)
{
    int clusters = (view_count + cluster_size - 1) / cluster_size;

    return PAYS * kept_clusters(clusters) * (1 + kept_members(view_count / clusters)) <= view_count;
}

static void thin(struct lumi_clusters *clusters)
{
    int kept = kept_clusters(clusters->count), at = 0;

    for (int i = 0; i < kept; i++) {
        int from = spread(i, kept, clusters->count);
        int first = clusters->first[from], others = clusters->first[from + 1] - first - 1, taken = kept_members(others);
        clusters->first[i] = at;
        clusters->members[at++] = clusters->members[first];
        for (int k = 0; k < taken; k++)
            clusters->members[at++] = clusters->members[first + 1 + spread(k, taken, others)];
    }
    clusters->first[kept] = at;
    clusters->count = kept;
}

static double geometry_bytes(const struct compress_level *level)
{
    double bytes = 0;

    for (int i = 0; i < level->count; i++) {
        g_autofree char *path = lumi_run_path(
            level->run, level->index == LUMI_LEVEL_COARSE ? "geometry-coarse" : "geometry", level->sources[i], ".mesh");
        GStatBuf status;
        if (g_stat(path, &status) == 0)
            bytes += (double)status.st_size + VIEW_BYTES;
    }
    return bytes;
}

static int level_bytes(struct compress_level *level, double *bytes, struct lumi_error *error)
{
    const struct lumi_clusters *clusters = &level->clusters;
    int all_clusters = clusters->count, all_others = level->count - clusters->count;
    double references, others;

    level->sample = true;
    thin(&level->clusters);
    LUMI_TRY(compress_level_code(level, error));
    LUMI_TRY(compress_level_bytes(level, &references, &others, error));
    int coded_others = clusters->first[clusters->count] - clusters->count;
    *bytes = references * all_clusters / clusters->count + geometry_bytes(level);
    if (coded_others > 0)
        *bytes += others * all_others / coded_others;
    return LUMI_OK;
}

int compress_sample_size(struct lumi_run *run, int quality, long long *size, struct lumi_error *error)
{
    double all = 0;

    for (int i = 0; i < LUMI_LEVELS; i++) {
        struct compress_level level;
        double bytes = 0;
        int code = compress_level_init(&level, run, i, quality, error);
        if (code == LUMI_OK)
            code = level_bytes(&level, &bytes, error);
        compress_level_finish(&level);
        LUMI_TRY(code);
        all += bytes;
    }
    *size = (long long)(all + 0.5);
    return LUMI_OK;
}
