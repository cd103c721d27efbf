/* How far a run is, by what lies in its work folder. */
#include "pipeline/engine/outstanding.h"

#include "pipeline/engine/dependence.h"
#include "pipeline/graph/graph.h"

#include <glib.h>
#include <string.h>

void lumi_share_range(int share, int shares, int count, int *first, int *last)
{
    *first = (int)((long long)(share - 1) * count / shares);
    *last = (int)((long long)share * count / shares);
}

static int count_files(const struct lumi_run *run, const struct lumi_stage *stage)
{
    g_autofree char *folder = g_build_filename(run->work, stage->name, NULL);
    g_autoptr(GDir) dir = g_dir_open(folder, 0, NULL);
    const char *name;
    int count = 0;

    while (dir && (name = g_dir_read_name(dir)))
        count += stage->whole ? !strcmp(name, "all.key") : g_str_has_suffix(name, ".key");
    return count;
}

/* All that it reads of is done; otherwise what lies there may be made anew. */
static bool rests_on_done(const struct lumi_progress *progress, int stage)
{
    for (int i = 0; i < stage; i++)
        if (progress[i].wanted && progress[i].done < progress[i].count && lumi_stage_rests_on(stage, i))
            return false;
    return true;
}

static void look(struct lumi_run *run, const struct lumi_stage *stage, struct lumi_progress *progress, bool known,
                 bool settled)
{
    progress->wanted = !stage->wanted || stage->wanted(run, -1);
    if (!progress->wanted)
        return;
    progress->known = known;
    progress->count = known ? lumi_stage_count(run, stage) : stage->whole ? 1 : run->count;
    progress->made = g_new0(bool, (gsize)progress->count + 1);
    progress->files = count_files(run, stage);
    if (known && settled)
        progress->done = lumi_stage_done(run, stage, progress->made);
}

struct lumi_progress *lumi_outstanding_find(struct lumi_run *run)
{
    int count = 0;

    while (lumi_stages[count])
        count++;
    struct lumi_progress *progress = g_new0(struct lumi_progress, (gsize)count + 1);
    bool over = true; /* the first phase, so far */
    for (int i = 0; i < count; i++) {
        const struct lumi_stage *stage = lumi_stages[i];
        const bool first = stage->set == LUMI_SET_FRAMES;
        struct lumi_error error;
        if (!first && over && !run->placed)
            over = lumi_graph_place(run, &error) == LUMI_OK;
        look(run, stage, &progress[i], first || over, rests_on_done(progress, i));
        if (first && progress[i].done < progress[i].count)
            over = false;
    }
    return progress;
}

void lumi_outstanding_free(struct lumi_progress *progress)
{
    for (int i = 0; progress && lumi_stages[i]; i++)
        g_free(progress[i].made);
    g_free(progress);
}

bool lumi_outstanding_none(const struct lumi_progress *progress)
{
    for (int i = 0; lumi_stages[i]; i++)
        if (progress[i].wanted && (!progress[i].known || progress[i].done < progress[i].count))
            return false;
    return true;
}
