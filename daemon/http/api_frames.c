/* The frames on the sphere, and turning the rig by hand. */
#include "daemon/http/api_priv.h"
#include "daemon/http/api_report.h"

#include <math.h>
#include <string.h>

/* ---- frames ---- */

static void put_head(JsonBuilder *builder, struct lumi_http *http, const struct lumi_engine_frames *frames)
{
    lumi_engine_status(http->options.engine, http->status);
    lumi_api_put_text(builder, "capture", frames->capture);
    lumi_api_put_int(builder, "shots", frames->shots);
    lumi_api_put_array(builder, "cameras");
    for (int i = 0; i < frames->camera_count; i++)
        json_builder_add_string_value(builder, http->status->cameras[frames->cameras[i]].name);
    json_builder_end_array(builder);
}

/* Four decimals, without a printf each: there may be a hundred thousand frames. */
static void put_number(GString *text, double value)
{
    const int whole = (int)lround(fabs(value) * 10000);
    char digits[] = {value < 0 && whole ? '-' : ' ',  (char)('0' + whole / 10000 % 10), '.',
                     (char)('0' + whole / 1000 % 10), (char)('0' + whole / 100 % 10),   (char)('0' + whole / 10 % 10),
                     (char)('0' + whole % 10)};
    const int skip = digits[0] == ' ';

    g_string_append_len(text, digits + skip, (gssize)sizeof digits - skip);
}

static void put_direction(GString *text, const double direction[3])
{
    for (int i = 0; i < 3; i++) {
        g_string_append_c(text, i ? ',' : '[');
        put_number(text, direction[i]);
    }
    g_string_append_c(text, ']');
}

/* Letters, digits, '.', '_', '-' (docs/capture-format.md): nothing in a name has to be escaped. */
static void put_frames(GString *text, const struct lumi_engine *engine, const struct lumi_engine_frames *frames)
{
    const int count = frames->shots * frames->camera_count;
    g_autoptr(GString) directions = g_string_sized_new((size_t)count * 24 + 16);
    g_autoptr(GString) letters = g_string_sized_new((size_t)count + 16);
    struct lumi_engine_frame frame;

    g_string_append(text, ",\"names\":[");
    for (int i = 0; i < count; i++) {
        lumi_engine_frame(engine, frames, i, &frame);
        if (i) {
            g_string_append_c(text, ',');
            g_string_append_c(directions, ',');
        }
        g_string_append_c(text, '"');
        g_string_append(text, frame.name);
        g_string_append_c(text, '"');
        put_direction(directions, frame.direction);
        g_string_append_c(letters, frame.letter);
    }
    g_string_append(text, "],\"directions\":[");
    g_string_append_len(text, directions->str, (gssize)directions->len);
    g_string_append(text, "],\"letters\":\"");
    g_string_append_len(text, letters->str, (gssize)letters->len);
    g_string_append(text, "\"}");
}

void lumi_api_get_frames(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_engine_frames frames;

    (void)body;
    lumi_engine_frames(http->options.engine, &frames);
    json_builder_begin_object(builder);
    put_head(builder, http, &frames);
    json_builder_end_object(builder);
    g_autofree char *head = lumi_api_finish(builder);
    GString *text = g_string_new_len(head, (gssize)strlen(head) - 1); /* the object goes on */
    put_frames(text, http->options.engine, &frames);
    lumi_api_answer(answer, 200, "application/json", g_string_free(text, FALSE));
}

/* ---- by hand ---- */

const struct lumi_api_field lumi_api_jog_fields[] = {
    {.name = "degrees", .type = LUMI_API_NUMBER, .required = true, .least = -360, .most = 360},
    {0},
};

void lumi_api_post_jog(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body)
{
    struct lumi_error error;
    int code = lumi_engine_jog(http->options.engine, http->options.now_ns(http->options.context),
                               body->values[0].real * (3.14159265358979323846 / 180), &error);

    lumi_api_answer_wish(http, answer, code, &error);
}
