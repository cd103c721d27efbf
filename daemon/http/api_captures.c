/* Captures on the disk: what there is, and a small picture of each. Looked for in the worker. */
#include "daemon/http/api_lookup.h"
#include "daemon/http/api_shelf.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define CAPTURES_MAX 1000
#define THUMBNAIL_MOST ((size_t)1 << 20)

static void put_states(JsonBuilder *builder, const struct lumi_capture_info *info)
{
    lumi_api_put_object(builder, "in_state");
    for (int i = 0; i < (int)(sizeof info->in_state / sizeof info->in_state[0]); i++)
        lumi_api_put_int(builder, lumi_frame_state_name((enum lumi_frame_state)i), info->in_state[i]);
    json_builder_end_object(builder);
}

static void put_capture(struct lumi_api_lookup *lookup, JsonBuilder *builder, const char *name, const char *path)
{
    struct lumi_capture *capture = NULL;
    struct lumi_capture_info info = {0};
    char title[256] = "", created[64] = "", seal[65] = "";
    struct lumi_error error = {0}, ignored;
    int code = lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &error);

    if (code == LUMI_OK)
        code = lumi_capture_info(capture, &info, &error);
    if (code == LUMI_OK)
        code = lumi_capture_get_meta(capture, "title", title, sizeof title, &error);
    if (code == LUMI_OK)
        code = lumi_capture_get_meta(capture, "created", created, sizeof created, &error);
    lumi_capture_close(capture);
    lumi_capture_seal_of(path, seal, &ignored);
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "name", name);
    lumi_api_put_text(builder, "path", path);
    lumi_api_put_text(builder, "title", title);
    lumi_api_put_text(builder, "created", created);
    lumi_api_put_bool(builder, "sealed", info.sealed);
    lumi_api_put_text(builder, "seal", seal);
    lumi_api_put_verified(builder, lookup->http->shelf, name, seal);
    lumi_api_put_bool(builder, "thumbnail",
                      info.in_state[LUMI_FRAME_RECEIVED] + info.in_state[LUMI_FRAME_ACCEPTED] > 0);
    lumi_api_put_int(builder, "shots", info.shots);
    lumi_api_put_int(builder, "frames", info.frames);
    put_states(builder, &info);
    lumi_api_put_int(builder, "bytes", info.frame_bytes);
    lumi_api_put_text(builder, "error", code == LUMI_OK ? "" : error.text);
    json_builder_end_object(builder);
}

static int newest_first(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*b)->d_name, (*a)->d_name); /* names begin with the date where nobody chose another */
}

static void look_for_captures(struct lumi_api_lookup *lookup)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    const char *folder = lookup->http->options.folder;
    struct dirent **entries;
    int count = folder ? scandir(folder, &entries, NULL, newest_first) : 0, put = 0;

    if (count < 0) {
        lookup->code = lumi_fail_errno(&lookup->error, folder, "read");
        return;
    }
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "folder", folder ? folder : "");
    lumi_api_put_bool(builder, "second_copy", lookup->http->options.second_copy != NULL);
    lumi_api_put_array(builder, "captures");
    for (int i = 0; i < count; i++) {
        char path[LUMI_SHELF_PATH];
        struct lumi_error none;
        if (put < CAPTURES_MAX && lumi_shelf_find(folder, entries[i]->d_name, path, &none) == LUMI_OK) {
            put_capture(lookup, builder, entries[i]->d_name, path);
            put++;
        }
        free(entries[i]);
    }
    if (folder)
        free(entries);
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lookup->text = lumi_api_finish(builder);
}

void lumi_api_serve_captures(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    (void)body;
    lumi_api_look_up(http, message, look_for_captures, "");
}

/* ---- thumbnails ---- */

static bool is_newer(const char *file, const char *capture)
{
    g_autofree char *database = g_build_filename(capture, "data", "capture.db", NULL);
    struct stat made, of;

    return !stat(file, &made) && !stat(database, &of) &&
           (made.st_mtim.tv_sec > of.st_mtim.tv_sec ||
            (made.st_mtim.tv_sec == of.st_mtim.tv_sec && made.st_mtim.tv_nsec >= of.st_mtim.tv_nsec));
}

static void look_for_thumbnail(struct lumi_api_lookup *lookup)
{
    const char *folder = lookup->http->options.folder;
    g_autofree char *kept = folder ? g_build_filename(folder, ".lumid", "thumbnails", NULL) : NULL;
    g_autofree char *file = folder ? g_strdup_printf("%s/%s.jpg", kept, lookup->name) : NULL;
    char path[LUMI_SHELF_PATH];

    lookup->code = folder ? lumi_shelf_find(folder, lookup->name, path, &lookup->error)
                          : lumi_fail(&lookup->error, LUMI_ERR_NOTFOUND, "there are no captures here");
    if (lookup->code == LUMI_OK && !is_newer(file, path)) {
        g_mkdir_with_parents(kept, 0755);
        lookup->code = lumi_shelf_thumbnail(path, file, &lookup->error);
    }
    if (lookup->code == LUMI_OK)
        lookup->code = lumi_file_read(file, THUMBNAIL_MOST, &lookup->data, &lookup->size, &lookup->error);
    lookup->type = "image/jpeg";
}

void lumi_api_serve_thumbnail(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    lumi_api_look_up(http, message, look_for_thumbnail, body->part);
}
