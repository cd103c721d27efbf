/* What the hand-over reads from outside: journals, the processing command, lines of its output. The first byte chooses.
 */
#include "checks.h"

#include "daemon/handover/handover_command.h"
#include "daemon/handover/handover_journal.h"

#include <glib.h>

static int take_line(void *context, const struct journal_line *line, struct lumi_error *error)
{
    (void)context;
    (void)error;
    if (line->count < 1 || line->count > JOURNAL_FIELDS)
        abort();
    for (int i = 0; i < line->count; i++)
        for (const char *c = line->fields[i]; *c; c++)
            if ((unsigned char)*c < 0x20 || *c == 0x7f)
                abort();
    return LUMI_OK;
}

static void read_journal(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    size_t whole;

    checked(journal_parse(data, size, "journal", take_line, NULL, &whole, &error), &error);
    if (whole > size || (whole > 0 && data[whole - 1] != '\n'))
        abort();
}

static void read_text(const char *text, bool command)
{
    struct lumi_process_status status = {.progress = -1};
    struct lumi_error error = {0};
    char **words;

    if (!command) {
        handover_read_line(text, &status);
        if (!(status.progress == -1 || (status.progress >= 0 && status.progress <= 1)))
            abort();
    } else if (checked(handover_words(text, "/a/b.capture", &words, &error), &error) == LUMI_OK) {
        g_strfreev(words);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    if (data[0] == 'j') {
        read_journal(data + 1, size - 1);
        return 0;
    }
    char *text = g_strndup((const char *)data + 1, size - 1);
    read_text(text, data[0] == 'c');
    g_free(text);
    return 0;
}
