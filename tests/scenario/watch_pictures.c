/* A client of the cameras' pictures, for scenarios: gets a path, or so many pictures of a live stream, and looks
 * whether they are what they should be. usage: watch_pictures ADDRESS get PATH watch_pictures ADDRESS live CAMERA COUNT
 */
#include "proto/image/image.h"

#include <libsoup/soup.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH_MAX 640

static _Noreturn void fail(const char *what, const char *why)
{
    fprintf(stderr, "%s: %s\n", what, why);
    exit(1);
}

static GInputStream *get(SoupSession *session, SoupMessage *message, const char *path)
{
    GError *error = NULL;
    GInputStream *stream = soup_session_send(session, message, NULL, &error);

    if (!stream)
        fail(path, error->message);
    if (soup_message_get_status(message) != 200)
        fail(path, soup_message_get_reason_phrase(message));
    return stream;
}

static GBytes *read_all(GInputStream *stream, const char *path)
{
    GOutputStream *memory = g_memory_output_stream_new_resizable();
    GError *error = NULL;

    if (g_output_stream_splice(memory, stream, G_OUTPUT_STREAM_SPLICE_CLOSE_TARGET, NULL, &error) < 0)
        fail(path, error->message);
    GBytes *bytes = g_memory_output_stream_steal_as_bytes(G_MEMORY_OUTPUT_STREAM(memory));
    g_object_unref(memory);
    return bytes;
}

/* True: it is not the one before. */
static bool look_at(GBytes *bytes, GBytes *before, const char *path)
{
    struct lumi_raster raster;
    struct lumi_error error;
    gsize size;
    const void *data = g_bytes_get_data(bytes, &size);

    if (lumi_image_read_memory(data, size, path, 3, &raster, NULL, &error) != LUMI_OK)
        fail(path, error.text);
    if (raster.width > WIDTH_MAX)
        fail(path, "it is too wide");
    lumi_raster_finish(&raster);
    return !before || !g_bytes_equal(bytes, before);
}

static void watch(SoupMessage *message, GInputStream *stream, const char *path, int wanted)
{
    SoupMultipartInputStream *parts = soup_multipart_input_stream_new(message, stream);
    GBytes *before = NULL;
    int different = 0;

    for (int i = 0; i < wanted; i++) {
        GError *error = NULL;
        GInputStream *part = soup_multipart_input_stream_next_part(parts, NULL, &error);
        if (!part)
            fail(path, error ? error->message : "it has ended");
        GBytes *bytes = read_all(part, path);
        different += look_at(bytes, before, path);
        if (before)
            g_bytes_unref(before);
        before = bytes;
        g_object_unref(part);
    }
    printf("%d pictures, %d different\n", wanted, different);
    if (before)
        g_bytes_unref(before);
    g_object_unref(parts);
}

int main(int argc, char **argv)
{
    if (argc < 4)
        fail("usage", "watch_pictures ADDRESS get PATH | live CAMERA COUNT");
    const bool live = strcmp(argv[2], "live") == 0;
    char *path = live ? g_strdup_printf("/api/v1/cameras/%s/live", argv[3]) : g_strdup(argv[3]);
    char *address = g_strconcat(argv[1], path, NULL);
    SoupSession *session = soup_session_new();
    SoupMessage *message = soup_message_new("GET", address);

    if (!message)
        fail(address, "no address");
    GInputStream *stream = get(session, message, path);
    if (live) {
        watch(message, stream, path, argc > 4 ? atoi(argv[4]) : 1);
    } else {
        GBytes *bytes = read_all(stream, path);
        if (g_str_has_suffix(path, ".jpg"))
            look_at(bytes, NULL, path);
        fwrite(g_bytes_get_data(bytes, NULL), 1, g_bytes_get_size(bytes), stdout);
        g_bytes_unref(bytes);
    }
    g_object_unref(stream);
    g_object_unref(message);
    g_object_unref(session);
    g_free(address);
    g_free(path);
    return 0;
}
