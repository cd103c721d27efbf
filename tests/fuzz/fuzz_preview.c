/* Both sides of the preview's line: what `lumi preview` is asked, what lumid is told. The first byte chooses. */
#include "checks.h"

#include "daemon/preview/field_answer.h"
#include "pipeline/preview/preview_line.h"

#include <glib.h>

static void read_question(const uint8_t *data, size_t size)
{
    char *line = g_strndup((const char *)data, size);
    struct lumi_preview_gaze gaze;
    struct lumi_error error = {0};
    uint32_t id;

    if (checked(lumi_preview_line_parse(line, &id, &gaze, &error), &error) == LUMI_OK &&
        (!(gaze.fov > 0) || gaze.width < 1 || gaze.height < 1 || gaze.width > LUMI_PREVIEW_SIZE_MAX ||
         gaze.height > LUMI_PREVIEW_SIZE_MAX))
        abort();
    g_free(line);
}

static void take(void *context, const struct lumi_field_answer *answer)
{
    (void)context;
    if (answer->kind == LUMI_FIELD_PICTURE && (!answer->data || answer->size == 0))
        abort();
    if (answer->frames < 0 || answer->rows < 0 || answer->views < 0 || !answer->text)
        abort();
}

/* In two pieces: the second byte says where the first ends. */
static void read_answers(const uint8_t *data, size_t size)
{
    struct lumi_field_reader reader = {0};
    struct lumi_error error = {0};
    const size_t cut = size ? data[0] % size : 0;

    if (checked(lumi_field_reader_feed(&reader, data, cut, take, NULL, &error), &error) == LUMI_OK)
        checked(lumi_field_reader_feed(&reader, data + cut, size - cut, take, NULL, &error), &error);
    lumi_field_reader_finish(&reader);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0)
        return 0;
    if (data[0] == 'v')
        read_question(data, size);
    else
        with_and_without_memory(data + 1, size - 1, read_answers);
    return 0;
}
