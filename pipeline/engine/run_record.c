/* The record of a run: lines "WORD VALUE", texts escaped as in C. */
#include "pipeline/engine/run_record.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <stdio.h>
#include <string.h>

enum { LIMIT = 1 << 20, JOBS_MAX = 10000, TEXTS_MAX = 1000 };

#define FIRST_LINE "lumi run 1"

static const char *const engines[] = {"local", "slurm"};

void lumi_record_init(struct lumi_record *record)
{
    *record = (struct lumi_record){.arguments = g_ptr_array_new_with_free_func(g_free),
                                   .options = g_ptr_array_new_with_free_func(g_free),
                                   .jobs = g_array_new(FALSE, TRUE, sizeof(struct lumi_record_job))};
}

void lumi_record_finish(struct lumi_record *record)
{
    g_free(record->folder);
    g_free(record->capture);
    g_free(record->output);
    g_free(record->command);
    g_clear_pointer(&record->arguments, g_ptr_array_unref);
    g_clear_pointer(&record->options, g_ptr_array_unref);
    g_clear_pointer(&record->jobs, g_array_unref);
    *record = (struct lumi_record){0};
}

/* Bytes from 0x80 stay as they are, so that names in UTF-8 can be read. */
static char *escape(const char *text)
{
    char high[129];

    for (int i = 0; i < 128; i++)
        high[i] = (char)(0x80 + i);
    high[128] = '\0';
    return g_strescape(text, high);
}

static bool take_text(char **field, const char *value)
{
    if (*field || !*value)
        return false;
    *field = g_strcompress(value);
    return **field != '\0';
}

static bool take_listed(GPtrArray *list, const char *value)
{
    if (list->len >= TEXTS_MAX || !*value)
        return false;
    g_ptr_array_add(list, g_strcompress(value));
    return true;
}

static bool take_number(int *field, const char *value, int least, int most)
{
    gint64 number;

    if (!g_ascii_string_to_signed(value, 10, least, most, &number, NULL))
        return false;
    *field = (int)number;
    return true;
}

static bool take_job(GArray *jobs, const char *value)
{
    struct lumi_record_job job = {0};
    int end = 0;

    if (jobs->len >= JOBS_MAX || sscanf(value, "%31[a-z-] %lld %d%n", job.stage, &job.id, &job.shares, &end) != 3 ||
        value[end] || job.id < 1 || job.shares < 1)
        return false;
    g_array_append_val(jobs, job);
    return true;
}

static bool take_engine(enum lumi_engine *engine, const char *value)
{
    for (int i = 0; i < 2; i++)
        if (!strcmp(value, engines[i])) {
            *engine = (enum lumi_engine)i;
            return true;
        }
    return false;
}

static bool take_line(struct lumi_record *record, const char *word, const char *value)
{
    if (!strcmp(word, "engine"))
        return take_engine(&record->engine, value);
    if (!strcmp(word, "folder"))
        return take_text(&record->folder, value);
    if (!strcmp(word, "capture"))
        return take_text(&record->capture, value);
    if (!strcmp(word, "output"))
        return take_text(&record->output, value);
    if (!strcmp(word, "command"))
        return take_text(&record->command, value);
    if (!strcmp(word, "argument"))
        return take_listed(record->arguments, value);
    if (!strcmp(word, "option"))
        return take_listed(record->options, value);
    if (!strcmp(word, "chunk"))
        return take_number(&record->chunk, value, 0, 1000000);
    if (!strcmp(word, "retries"))
        return take_number(&record->retries, value, 0, 100);
    if (!strcmp(word, "threads"))
        return take_number(&record->threads, value, 0, 4096);
    if (!strcmp(word, "job"))
        return take_job(record->jobs, value);
    return false;
}

int lumi_record_parse(const char *text, size_t size, const char *source, struct lumi_record *record,
                      struct lumi_error *error)
{
    if (size > LIMIT || memchr(text, '\0', size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is no record of a run", source);
    g_autofree char *copy = g_strndup(text, size);
    g_auto(GStrv) lines = g_strsplit(copy, "\n", -1);
    for (int i = 0; lines[i]; i++) {
        char *space = strchr(lines[i], ' ');
        if (i == 0 && strcmp(lines[i], FIRST_LINE) != 0)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: does not begin with '%s'", source, FIRST_LINE);
        if (i == 0 || (!lines[i][0] && !lines[i + 1]))
            continue;
        if (space)
            *space = '\0';
        if (!space || !take_line(record, lines[i], space + 1))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d makes no sense", source, i + 1);
    }
    if (!record->folder || !record->capture || !record->output || !record->command)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is not whole", source);
    return LUMI_OK;
}

int lumi_record_read(const char *work, struct lumi_record *record, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(work, LUMI_RECORD_FILE, NULL);
    uint8_t *data;
    size_t size;

    if (!g_file_test(path, G_FILE_TEST_EXISTS))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: nothing was run there ('lumi process' begins a run)", work);
    LUMI_TRY(lumi_file_read(path, LIMIT, &data, &size, error));
    const int code = lumi_record_parse((const char *)data, size, path, record, error);
    lumi_free(data);
    return code;
}

static void add_text(GString *text, const char *word, const char *value)
{
    g_autofree char *escaped = escape(value);

    g_string_append_printf(text, "%s %s\n", word, escaped);
}

int lumi_record_write(const char *work, const struct lumi_record *record, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(work, LUMI_RECORD_FILE, NULL);
    g_autoptr(GString) text = g_string_new(FIRST_LINE "\n");

    g_string_append_printf(text, "engine %s\n", engines[record->engine]);
    add_text(text, "folder", record->folder);
    add_text(text, "capture", record->capture);
    add_text(text, "output", record->output);
    add_text(text, "command", record->command);
    for (guint i = 0; i < record->arguments->len; i++)
        add_text(text, "argument", g_ptr_array_index(record->arguments, i));
    for (guint i = 0; i < record->options->len; i++)
        add_text(text, "option", g_ptr_array_index(record->options, i));
    g_string_append_printf(text, "chunk %d\nretries %d\nthreads %d\n", record->chunk, record->retries, record->threads);
    for (guint i = 0; i < record->jobs->len; i++) {
        const struct lumi_record_job *job = &g_array_index(record->jobs, struct lumi_record_job, i);
        g_string_append_printf(text, "job %s %lld %d\n", job->stage, job->id, job->shares);
    }
    return lumi_file_write(path, text->str, text->len, true, error);
}
