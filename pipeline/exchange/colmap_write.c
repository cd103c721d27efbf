/* COLMAP's cameras and images, written: numbered from 1 in the list's order, without points. colmap.c has the formats.
 */
#include "pipeline/exchange/exchange.h"

#include "proto/base/bytes.h"

#include <string.h>

static void append_number(GByteArray *out, double value)
{
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    g_ascii_formatd(digits, sizeof digits, "%.17g", value);
    g_byte_array_append(out, (const guint8 *)" ", 1);
    g_byte_array_append(out, (const guint8 *)digits, (guint)strlen(digits));
}

static void append_text(GByteArray *out, const char *text)
{
    g_byte_array_append(out, (const guint8 *)text, (guint)strlen(text));
}

static void append_writer(GByteArray *out, struct lumi_writer *writer)
{
    if (writer->size > 0)
        g_byte_array_append(out, writer->data, (guint)writer->size);
    lumi_writer_finish(writer);
}

static void cameras_text(const struct lumi_exchange *exchange, GByteArray *out)
{
    append_text(out, "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n");
    for (guint i = 0; i < exchange->cameras->len; i++) {
        const struct lumi_exchange_camera *camera = lumi_exchange_camera(exchange, (int)i);
        g_autofree char *head = g_strdup_printf("%u %s %d %d", i + 1, camera->model, camera->width, camera->height);
        append_text(out, head);
        for (int p = 0; p < camera->parameter_count; p++)
            append_number(out, camera->parameters[p]);
        append_text(out, "\n");
    }
}

void lumi_exchange_format_colmap_cameras(const struct lumi_exchange *exchange, bool binary, GByteArray *out)
{
    struct lumi_writer writer;

    if (!binary) {
        cameras_text(exchange, out);
        return;
    }
    lumi_writer_init(&writer);
    lumi_write_u64(&writer, exchange->cameras->len);
    for (guint i = 0; i < exchange->cameras->len; i++) {
        const struct lumi_exchange_camera *camera = lumi_exchange_camera(exchange, (int)i);
        const struct lumi_exchange_model *model = lumi_exchange_model_by_name(camera->model);
        lumi_write_u32(&writer, i + 1);
        lumi_write_u32(&writer, (uint32_t)(model ? model->id : -1));
        lumi_write_u64(&writer, (uint64_t)camera->width);
        lumi_write_u64(&writer, (uint64_t)camera->height);
        for (int p = 0; p < camera->parameter_count; p++)
            lumi_write_f64(&writer, camera->parameters[p]);
    }
    append_writer(out, &writer);
}

static void image_numbers(const struct lumi_exchange_image *image, double numbers[7])
{
    if (image->numbers == LUMI_EXCHANGE_QUATERNION)
        memcpy(numbers, image->source, 7 * sizeof *numbers);
    else
        lumi_exchange_pose_to(LUMI_EXCHANGE_QUATERNION, &image->pose, numbers);
}

static void images_text(const struct lumi_exchange *exchange, GByteArray *out)
{
    append_text(out, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and a line of points\n");
    for (guint i = 0; i < exchange->images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        g_autofree char *head = g_strdup_printf("%u", i + 1);
        g_autofree char *tail = g_strdup_printf(" %d %s\n\n", image->camera + 1, image->original);
        double numbers[7];
        image_numbers(image, numbers);
        append_text(out, head);
        for (int n = 0; n < 7; n++)
            append_number(out, numbers[n]);
        append_text(out, tail);
    }
}

void lumi_exchange_format_colmap_images(const struct lumi_exchange *exchange, bool binary, GByteArray *out)
{
    struct lumi_writer writer;

    if (!binary) {
        images_text(exchange, out);
        return;
    }
    lumi_writer_init(&writer);
    lumi_write_u64(&writer, exchange->images->len);
    for (guint i = 0; i < exchange->images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        double numbers[7];
        image_numbers(image, numbers);
        lumi_write_u32(&writer, i + 1);
        for (int n = 0; n < 7; n++)
            lumi_write_f64(&writer, numbers[n]);
        lumi_write_u32(&writer, (uint32_t)image->camera + 1);
        lumi_write_bytes(&writer, image->original, strlen(image->original) + 1);
        lumi_write_u64(&writer, 0);
    }
    append_writer(out, &writer);
}
