/* Throwing away what stages have made. */
#include "pipeline/engine/clear_work.h"

#include "pipeline/engine/dependence.h"
#include "pipeline/engine/run_record.h"
#include "pipeline/engine/slurm_run.h"
#include "pipeline/graph/graph.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <glib.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

enum { OPEN_FOLDERS = 16 };

int lumi_clear_choose(const char *const *names, bool *chosen, struct lumi_error *error)
{
    for (int i = 0; lumi_stages[i]; i++)
        chosen[i] = !names || !names[0];
    for (; names && *names; names++) {
        int named = 0;
        while (lumi_stages[named] && strcmp(lumi_stages[named]->name, *names) != 0)
            named++;
        if (!lumi_stages[named])
            return lumi_fail(error, LUMI_ERR_ARG, "no stage '%s' ('lumi stage' lists them)", *names);
        for (int i = named; lumi_stages[i]; i++)
            chosen[i] = chosen[i] || i == named || lumi_stage_rests_on(i, named);
    }
    return LUMI_OK;
}

static int64_t walked_bytes;

static int add_bytes(const char *path, const struct stat *status, int kind, struct FTW *where)
{
    (void)path;
    (void)where;
    if (kind == FTW_F)
        walked_bytes += status->st_size;
    return 0;
}

static int remove_one(const char *path, const struct stat *status, int kind, struct FTW *where)
{
    (void)status;
    (void)kind;
    (void)where;
    return remove(path);
}

void lumi_clear_measure(const char *work, const bool *chosen, int *folders, int64_t *bytes)
{
    *folders = 0;
    walked_bytes = 0;
    for (int i = 0; lumi_stages[i]; i++) {
        g_autofree char *path = g_build_filename(work, lumi_stages[i]->name, NULL);
        if (chosen[i] && nftw(path, add_bytes, OPEN_FOLDERS, FTW_PHYS) == 0)
            (*folders)++;
    }
    *bytes = walked_bytes;
}

static int remove_below(const char *work, const char *name, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(work, name, NULL);

    if (nftw(path, remove_one, OPEN_FOLDERS, FTW_PHYS | FTW_DEPTH) && errno != ENOENT)
        return lumi_fail_errno(error, path, "remove");
    return LUMI_OK;
}

static int remove_chosen(const char *work, const bool *chosen, struct lumi_error *error)
{
    static const char *const rest[] = {"slurm", LUMI_RECORD_FILE, ".hand-over", NULL};
    bool all = true;

    for (int i = 0; lumi_stages[i]; i++) {
        all = all && chosen[i];
        if (chosen[i])
            LUMI_TRY(remove_below(work, lumi_stages[i]->name, error));
    }
    for (int i = 0; all && rest[i]; i++)
        LUMI_TRY(remove_below(work, rest[i], error));
    if (all) {
        LUMI_TRY(remove_below(work, ".lock", error));
        rmdir(work); /* what is none of ours stays, and the folder with it */
    }
    return LUMI_OK;
}

int lumi_clear_work(const char *work, const bool *chosen, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(work, ".lock", NULL);

    if (!g_file_test(work, G_FILE_TEST_IS_DIR))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no such work folder", work);
    LUMI_TRY(lumi_slurm_check_idle(work, error));
    const int lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (lock < 0)
        return lumi_fail_errno(error, path, "create");
    int code = LUMI_OK;
    if (flock(lock, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK)
        code = lumi_fail(error, LUMI_ERR_BUSY, "%s: another run is at work there", work);
    if (code == LUMI_OK)
        code = remove_chosen(work, chosen, error);
    close(lock);
    return code;
}
