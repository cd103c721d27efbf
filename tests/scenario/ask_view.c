/* Asks lumid for a view of the light field so far until it gets one.
 * usage: ask_view ROW FRAMES [X Y Z YAW]: waits until the capture under way has ROW frames stored, then asks until the
 * picture is made of FRAMES or more. Prints "SECONDS FRAMES WIDTH HEIGHT MEAN": from the row to the picture.
 * LUMID_ADDRESS says where. */
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/image/image.h"

#include <json-glib/json-glib.h>
#include <libsoup/soup.h>
#include <stdio.h>
#include <stdlib.h>

#define PATIENCE_US (120 * G_USEC_PER_SEC)

static SoupSession *session;
static char *refusal; /* the last answer that was none */

/* (transfer full) NULL: not 200. */
static GBytes *get(const char *path, int *frames)
{
    g_autofree char *url = g_strconcat(g_getenv("LUMID_ADDRESS"), path, NULL);
    g_autoptr(SoupMessage) message = soup_message_new("GET", url);
    GBytes *bytes = soup_session_send_and_read(session, message, NULL, NULL);

    if (!bytes || soup_message_get_status(message) != 200) {
        g_free(refusal);
        refusal = bytes ? g_strndup(g_bytes_get_data(bytes, NULL), g_bytes_get_size(bytes)) : NULL;
        g_clear_pointer(&bytes, g_bytes_unref);
        return NULL;
    }
    const char *header = soup_message_headers_get_one(soup_message_get_response_headers(message), "X-Lumid-Frames");
    if (frames)
        *frames = header ? atoi(header) : 0;
    return bytes;
}

static gint64 stored(void)
{
    g_autoptr(GBytes) bytes = get("/api/v1/capture", NULL);
    g_autoptr(JsonParser) parser = json_parser_new();
    gsize size;
    const char *text = bytes ? g_bytes_get_data(bytes, &size) : NULL;

    if (!text || !json_parser_load_from_data(parser, text, (gssize)size, NULL))
        return 0;
    JsonObject *capture = json_node_get_object(json_parser_get_root(parser));
    return json_object_get_int_member(capture, "stored") + json_object_get_int_member(capture, "accepted");
}

static int print_picture(GBytes *bytes, double seconds, int frames)
{
    struct lumi_raster raster;
    struct lumi_error error;
    gsize size;
    const void *data = g_bytes_get_data(bytes, &size);
    double sum = 0;

    if (lumi_image_read_memory(data, size, "the answer", 3, &raster, NULL, &error) != LUMI_OK) {
        fprintf(stderr, "ask_view: %s\n", error.text);
        return 1;
    }
    for (int y = 0; y < raster.height; y++)
        for (int x = 0; x < 3 * raster.width; x++)
            sum += lumi_row_u8(&raster, y)[x];
    printf("%.2f %d %d %d %.1f\n", seconds, frames, raster.width, raster.height,
           sum / (3.0 * raster.width * raster.height));
    lumi_raster_finish(&raster);
    return 0;
}

int main(int argc, char **argv)
{
    const gint64 end = g_get_monotonic_time() + PATIENCE_US;

    if (argc != 3 && argc != 7)
        return 2;
    session = soup_session_new();
    g_autofree char *path = argc == 7
                                ? g_strdup_printf("/api/v1/field/view.jpg?width=160&height=120&x=%s&y=%s&z=%s&yaw=%s",
                                                  argv[3], argv[4], argv[5], argv[6])
                                : g_strdup("/api/v1/field/view.jpg?width=160&height=120");
    while (stored() < atoi(argv[1]) && g_get_monotonic_time() < end)
        g_usleep(50000);
    const gint64 row = g_get_monotonic_time();
    while (g_get_monotonic_time() < end) {
        int frames = 0;
        g_autoptr(GBytes) bytes = get(path, &frames);
        if (bytes && frames >= atoi(argv[2])) {
            const int code = print_picture(bytes, (double)(g_get_monotonic_time() - row) / G_USEC_PER_SEC, frames);
            g_object_unref(session);
            return code;
        }
        g_usleep(100000);
    }
    fprintf(stderr, "ask_view: no picture of %s frames within two minutes: %s\n", argv[2], refusal ? refusal : "");
    return 1;
}
