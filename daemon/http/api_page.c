/* The operator's page: files that were put into the program, and what every answer tells a browser.
 *
 * They hold nothing of the rig, so anybody may have them: whoever is not logged in sees the login. Each is compressed
 * once, when it is first asked for, and known by its checksum afterwards (ETag; RFC 9110, 8.8.3). */
#include "daemon/http/api_priv.h"

#include <string.h>

GResource *lumi_page_get_resource(void); /* made by the build from daemon/page */

#define FOLDER "/lumisphere/page/"

struct page_file {
    GBytes *plain, *packed;
    char *tag;
};

/* Of Content Security Policy Level 3: scripts, styles and pictures are the page's own, and nothing else is; no page may
 * frame it. */
static const char policy[] = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
                             "connect-src 'self'; font-src 'self'; manifest-src 'self'; base-uri 'none'; "
                             "form-action 'none'; frame-ancestors 'none'";

static const struct {
    const char *ending, *type;
} types[] = {
    {".html", "text/html; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".json", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".webmanifest", "application/manifest+json"},
};

static char **names; /* NULL-terminated, for as long as the program lives, as the files are */
static struct page_file *files;
static pthread_once_t once = PTHREAD_ONCE_INIT;

static GBytes *pack(GBytes *plain)
{
    g_autoptr(GZlibCompressor) compressor = g_zlib_compressor_new(G_ZLIB_COMPRESSOR_FORMAT_GZIP, 9);
    g_autoptr(GOutputStream) memory = g_memory_output_stream_new_resizable();
    g_autoptr(GOutputStream) stream = g_converter_output_stream_new(memory, G_CONVERTER(compressor));
    gsize size;
    const void *data = g_bytes_get_data(plain, &size);

    if (!g_output_stream_write_all(stream, data, size, NULL, NULL, NULL) || !g_output_stream_close(stream, NULL, NULL))
        return NULL;
    GBytes *packed = g_memory_output_stream_steal_as_bytes(G_MEMORY_OUTPUT_STREAM(memory));
    if (g_bytes_get_size(packed) < size)
        return packed;
    g_bytes_unref(packed);
    return NULL;
}

static void load(void)
{
    GResource *resource = lumi_page_get_resource();
    g_auto(GStrv) found = g_resource_enumerate_children(resource, FOLDER, 0, NULL);

    const guint count = found ? g_strv_length(found) : 0;

    names = g_new0(char *, count + 1);
    files = g_new0(struct page_file, count + 1);
    for (guint i = 0, put = 0; i < count; i++) {
        g_autofree char *path = g_strconcat(FOLDER, found[i], NULL);
        g_autoptr(GBytes) bytes = g_resource_lookup_data(resource, path, 0, NULL);
        if (!bytes)
            continue;
        g_autofree char *sum = g_compute_checksum_for_bytes(G_CHECKSUM_SHA256, bytes);
        files[put] = (struct page_file){.plain = g_bytes_ref(bytes), .packed = pack(bytes)};
        files[put].tag = g_strdup_printf("\"%.32s\"", sum);
        names[put++] = g_strdup(found[i]);
    }
}

const char *const *lumi_api_page_files(void)
{
    pthread_once(&once, load);
    return (const char *const *)names;
}

void lumi_api_harden(SoupServerMessage *message)
{
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);

    soup_message_headers_replace(headers, "Content-Security-Policy", policy);
    soup_message_headers_replace(headers, "X-Content-Type-Options", "nosniff");
    soup_message_headers_replace(headers, "Referrer-Policy", "no-referrer");
    soup_message_headers_replace(headers, "Cross-Origin-Resource-Policy", "same-origin");
    soup_message_headers_replace(headers, "Cross-Origin-Opener-Policy", "same-origin");
}

static const char *type_of(const char *name)
{
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (g_str_has_suffix(name, types[i].ending))
            return types[i].type;
    return "application/octet-stream";
}

static void send_file(SoupServerMessage *message, const char *name, const struct page_file *file)
{
    SoupMessageHeaders *asked = soup_server_message_get_request_headers(message);
    SoupMessageHeaders *headers = soup_server_message_get_response_headers(message);
    const char *known = soup_message_headers_get_list(asked, "If-None-Match");
    const char *accepted = soup_message_headers_get_list(asked, "Accept-Encoding");
    bool packed = file->packed && accepted && soup_header_contains(accepted, "gzip");

    soup_message_headers_replace(headers, "ETag", file->tag);
    soup_message_headers_replace(headers, "Cache-Control", "no-cache"); /* kept, and asked about each time */
    soup_message_headers_replace(headers, "Vary", "Accept-Encoding");
    if (known && strstr(known, file->tag)) {
        soup_server_message_set_status(message, 304, NULL);
        return;
    }
    if (packed)
        soup_message_headers_replace(headers, "Content-Encoding", "gzip");
    soup_message_headers_replace(headers, "Content-Type", type_of(name));
    soup_server_message_set_status(message, 200, NULL);
    soup_message_body_append_bytes(soup_server_message_get_response_body(message), packed ? file->packed : file->plain);
}

void lumi_api_serve_page(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const char *const *names_of = lumi_api_page_files();
    const char *wanted = *body->part ? body->part : "index.html";

    (void)http;
    for (int i = 0; names_of[i]; i++)
        if (!strcmp(names_of[i], wanted)) {
            send_file(message, wanted, &files[i]);
            return;
        }
    lumi_api_send_problem(message, 404, "path", "the page has no such file");
}
