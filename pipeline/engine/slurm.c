/* The Slurm engine. */
#include "pipeline/engine/slurm.h"

#include "pipeline/engine/dependence.h"
#include "pipeline/engine/local.h"
#include "pipeline/engine/slurm_call.h"
#include "pipeline/graph/graph.h"
#include "proto/base/file.h"

#include <glib/gstdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { CHUNK = 16, SHARES_MAX = 1000 }; /* Slurm's MaxArraySize is 1001 unless it is set */

#define LOGS "slurm"

char *lumi_slurm_mark(const char *work)
{
    char *real = realpath(work, NULL);
    g_autofree char *sum = g_compute_checksum_for_string(G_CHECKSUM_SHA256, real ? real : work, -1);

    free(real);
    return g_strndup(sum, 8);
}

int lumi_slurm_shares(int count, int chunk)
{
    const int images = chunk > 0 ? chunk : CHUNK;
    const int shares = count / images + (count % images != 0);

    return CLAMP(shares, 1, SHARES_MAX);
}

static bool share_is_made(const struct lumi_progress *progress, int share, int shares)
{
    int first, last;

    lumi_share_range(share, shares, progress->count, &first, &last);
    while (first < last && progress->made[first])
        first++;
    return first == last;
}

char *lumi_slurm_array(const struct lumi_progress *progress, int shares)
{
    GString *text = g_string_new(NULL);

    for (int share = 1; share <= shares; share++) {
        int end = share;
        if (progress->known && share_is_made(progress, share, shares))
            continue;
        while (end < shares && !(progress->known && share_is_made(progress, end + 1, shares)))
            end++;
        g_string_append_printf(text, "%s%d", text->len ? "," : "", share);
        if (end > share)
            g_string_append_printf(text, "-%d", end);
        share = end;
    }
    return g_string_free(text, FALSE);
}

/* A word of the task's script. */
static void add_word(GString *script, const char *word)
{
    g_autofree char *quoted = g_shell_quote(word);

    g_string_append_printf(script, " %s", quoted);
}

/* What a task does: its share, again where that fails, and a note of why where it gives up. Status 2 says that the
 * command line is wrong, which it stays. */
static char *write_script(const struct lumi_run *run, const struct lumi_record *record, const struct lumi_stage *stage,
                          int shares, bool last)
{
    GString *script = g_string_new("#!/bin/sh\n# One share of a stage; made by lumi process.\n");
    g_autofree char *work = g_canonicalize_filename(run->work, NULL);
    g_autofree char *note = g_build_filename(work, LOGS, stage->name, NULL);

    g_string_append(script, "cd");
    add_word(script, record->folder);
    g_string_append(script, " || exit 1\nshare=${SLURM_ARRAY_TASK_ID:-1}\nnote=");
    g_autofree char *quoted = g_shell_quote(note);
    g_string_append_printf(script, "%s-$share\ntry=0\nuntil %s stage %s", quoted, record->command, stage->name);
    add_word(script, record->capture);
    g_string_append(script, " --work");
    add_word(script, work);
    for (guint i = 0; i < record->arguments->len; i++)
        add_word(script, g_ptr_array_index(record->arguments, i));
    g_string_append_printf(script, " --share \"$share/%d\"", shares); /* threads: as many as it is given processors */
    if (last) {
        g_string_append(script, " --output");
        add_word(script, record->output);
    }
    g_string_append_printf(script,
                           " 2>\"$note.said\"\ndo\n"
                           "    status=$?\n"
                           "    [ -s \"$note.said\" ] || echo \"ended with status $status\" >\"$note.said\"\n"
                           "    cat \"$note.said\" >&2\n"
                           "    if [ $status -eq 2 ] || [ $try -ge %d ]; then\n"
                           "        mv \"$note.said\" \"$note.failed\"\n"
                           "        exit $status\n"
                           "    fi\n"
                           "    try=$((try + 1))\n"
                           "    sleep $((try * try))\n"
                           "done\n"
                           "cat \"$note.said\" >&2\n"
                           "rm -f \"$note.said\" \"$note.failed\"\n",
                           record->retries);
    return g_string_free(script, FALSE);
}

static void add_option(GPtrArray *arguments, const char *format, ...) G_GNUC_PRINTF(2, 3);
static void add_option(GPtrArray *arguments, const char *format, ...)
{
    va_list values;

    va_start(values, format);
    g_ptr_array_add(arguments, g_strdup_vprintf(format, values));
    va_end(values);
}

/* The user's own come last, and win. "STAGE:NAME=VALUE" is for one stage. */
static void add_users(GPtrArray *arguments, const struct lumi_record *record, const char *stage)
{
    for (guint i = 0; i < record->options->len; i++) {
        const char *option = g_ptr_array_index(record->options, i);
        const char *colon = strchr(option, ':'), *equals = strchr(option, '=');
        if (!colon || (equals && equals < colon))
            add_option(arguments, "--%s", option);
        else if (strlen(stage) == (size_t)(colon - option) && !strncmp(option, stage, strlen(stage)))
            add_option(arguments, "--%s", colon + 1);
    }
}

struct hand_over {
    struct lumi_run *run;
    const struct lumi_progress *progress;
    struct lumi_record *record;
    char *work, *mark;
    long long *jobs; /* of every stage, 0: none */
};

/* sbatch's arguments but the script. */
static GPtrArray *list_arguments(const struct hand_over *all, int number, const char *array)
{
    const struct lumi_stage *stage = lumi_stages[number];
    GPtrArray *arguments = g_ptr_array_new_with_free_func(g_free);
    g_autofree char *name = lumi_slurm_job_name(stage->name, all->mark);
    g_autoptr(GString) behind = g_string_new(NULL);
    const int threads = MAX(1, all->record->threads);
    const int64_t bytes = stage->serial || stage->whole ? 0 : lumi_engine_image_bytes(all->run, stage);

    add_option(arguments, "sbatch");
    add_option(arguments, "--parsable");
    add_option(arguments, "--requeue");
    add_option(arguments, "--open-mode=append");
    add_option(arguments, "--kill-on-invalid-dep=yes");
    add_option(arguments, "--job-name=%s", name);
    add_option(arguments, "--array=%s", array);
    add_option(arguments, "--cpus-per-task=%d", threads);
    add_option(arguments, "--output=%s/" LOGS "/%s-%%a.log", all->work, stage->name);
    if (bytes > 0) /* and a quarter of a gigabyte for the program and the list of images */
        add_option(arguments, "--mem=%lldM", (long long)((double)bytes * 1.25 * threads / 1e6) + 256);
    for (int i = 0; i < number; i++)
        if (all->jobs[i] && lumi_stage_rests_on(number, i))
            g_string_append_printf(behind, ":%lld", all->jobs[i]);
    if (behind->len)
        add_option(arguments, "--dependency=afterok%s", behind->str);
    add_users(arguments, all->record, stage->name);
    return arguments;
}

static int submit_stage(struct hand_over *all, int number, struct lumi_error *error)
{
    const struct lumi_stage *stage = lumi_stages[number];
    const struct lumi_progress *progress = &all->progress[number];
    const int shares = stage->whole ? 1 : lumi_slurm_shares(progress->count, all->record->chunk);
    const bool last = !lumi_stages[number + 1];
    g_autofree char *array = lumi_slurm_array(progress, shares);
    g_autofree char *script = write_script(all->run, all->record, stage, shares, last);
    g_autofree char *file = g_strdup_printf("%s.sh", stage->name);
    g_autofree char *path = g_build_filename(all->work, LOGS, file, NULL), *out = NULL;
    struct lumi_record_job job = {.shares = shares};

    LUMI_TRY(lumi_file_write(path, script, strlen(script), true, error));
    g_autoptr(GPtrArray) arguments = list_arguments(all, number, array);
    g_ptr_array_add(arguments, g_strdup(path));
    g_ptr_array_add(arguments, NULL);
    LUMI_TRY(lumi_slurm_call((char **)arguments->pdata, &out, error));
    LUMI_TRY(lumi_slurm_parse_job(out, &job.id, error));
    g_strlcpy(job.stage, stage->name, sizeof job.stage);
    g_array_append_val(all->record->jobs, job);
    all->jobs[number] = job.id;
    return lumi_record_write(all->run->work, all->record, error);
}

/* Notes of earlier tries say nothing of this one. */
static void forget_failures(const char *logs)
{
    g_autoptr(GDir) dir = g_dir_open(logs, 0, NULL);
    const char *name;

    while (dir && (name = g_dir_read_name(dir)))
        if (g_str_has_suffix(name, ".failed") || g_str_has_suffix(name, ".said")) {
            g_autofree char *path = g_build_filename(logs, name, NULL);
            unlink(path);
        }
}

int lumi_slurm_submit(struct lumi_run *run, const struct lumi_progress *progress, struct lumi_record *record,
                      struct lumi_error *error)
{
    struct hand_over all = {.run = run, .progress = progress, .record = record};
    g_autofree char *logs = g_build_filename(run->work, LOGS, NULL);
    int code = LUMI_OK, count = 0;

    while (lumi_stages[count])
        count++;
    if (g_mkdir_with_parents(logs, 0777))
        return lumi_fail_errno(error, logs, "create");
    forget_failures(logs);
    g_array_set_size(record->jobs, 0);
    all.jobs = g_new0(long long, (gsize)count + 1);
    all.work = g_canonicalize_filename(run->work, NULL);
    all.mark = lumi_slurm_mark(run->work);
    code = lumi_record_write(run->work, record, error);
    for (int i = 0; i < count && code == LUMI_OK; i++) {
        const struct lumi_progress *p = &progress[i];
        /* The last one also leaves the field where it is wanted. */
        if (p->wanted && (!p->known || p->done < p->count))
            code = submit_stage(&all, i, error);
    }
    g_free(all.jobs);
    g_free(all.work);
    g_free(all.mark);
    return code;
}

int lumi_slurm_count_live(const GArray *tasks)
{
    int count = 0;

    for (guint i = 0; i < tasks->len; i++)
        count += g_array_index(tasks, struct lumi_task, i).state <= LUMI_TASK_RUNNING;
    return count;
}

static int note_order(gconstpointer a, gconstpointer b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

/* The last line that has something in it. */
static char *last_line(const char *path)
{
    g_autofree char *text = NULL;

    if (!g_file_get_contents(path, &text, NULL, NULL))
        return NULL;
    g_strchomp(text);
    const char *newline = strrchr(text, '\n');
    return g_utf8_make_valid(newline ? newline + 1 : text, -1);
}

GPtrArray *lumi_slurm_failures(const char *work)
{
    GPtrArray *lines = g_ptr_array_new_with_free_func(g_free);
    g_autofree char *logs = g_build_filename(work, LOGS, NULL);
    g_autoptr(GDir) dir = g_dir_open(logs, 0, NULL);
    const char *name;

    while (dir && (name = g_dir_read_name(dir))) {
        g_autofree char *path = g_build_filename(logs, name, NULL), *line = NULL;
        const char *dash = strrchr(name, '-');
        if (!dash || !g_str_has_suffix(name, ".failed") || !(line = last_line(path)))
            continue;
        g_ptr_array_add(lines, g_strdup_printf("%.*s share %.*s: %s", (int)(dash - name), name,
                                               (int)strcspn(dash + 1, "."), dash + 1, line));
    }
    g_ptr_array_sort(lines, note_order);
    return lines;
}
