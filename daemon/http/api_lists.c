/* Answers that have to be looked for on disks and buses: in the worker, so that the server goes on. */
#include "daemon/http/api_priv.h"
#include "daemon/http/api_report.h"
#include "proto/capture/capture.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define CAMERAS_MAX 64
#define BOARDS_MAX 8
#define CAPTURES_MAX 1000

struct lookup {
    struct lumi_api_job job;
    struct lumi_http_options options; /* its strings stay as long as the worker lives */
    SoupServerMessage *message;
    bool gone; /* who asked has hung up */
    void (*look)(struct lookup *lookup);
    char *answer;
    struct lumi_error error;
    int code;
};

static void work(struct lumi_api_job *job)
{
    struct lookup *lookup = (struct lookup *)job;

    lookup->look(lookup);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    struct lookup *lookup = context;

    (void)message;
    lookup->gone = true;
}

static void done(struct lumi_api_letter *letter, bool dropped)
{
    struct lookup *lookup = (struct lookup *)letter;

    g_signal_handlers_disconnect_by_data(lookup->message, lookup);
    if (!lookup->gone && !dropped) {
        struct lumi_api_answer answer = {0};
        if (lookup->code != LUMI_OK)
            lumi_api_problem_of(&answer, lookup->code, lookup->error.text);
        else
            lumi_api_answer(&answer, 200, "application/json", g_steal_pointer(&lookup->answer));
        lumi_api_send(lookup->message, &answer);
        soup_server_message_unpause(lookup->message);
    }
    g_object_unref(lookup->message);
    g_free(lookup->answer);
    g_free(lookup);
}

static void look_up(struct lumi_http *http, SoupServerMessage *message, void (*look)(struct lookup *lookup))
{
    struct lookup *lookup = g_new0(struct lookup, 1);

    lookup->job.work = work;
    lookup->job.letter.read = done;
    lookup->options = http->options;
    lookup->look = look;
    lookup->message = g_object_ref(message);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), lookup);
    if (lumi_api_worker_give(http->worker, &lookup->job)) {
        soup_server_message_pause(message);
        return;
    }
    done(&lookup->job.letter, true);
    lumi_api_send_problem(message, 503, "busy", "too many such questions wait for an answer already");
}

/* ---- devices ---- */

static void put_boards(JsonBuilder *builder)
{
    struct lumi_rig_usb_board boards[BOARDS_MAX];
    struct lumi_error error;
    int count = lumi_rig_usb_list(boards, BOARDS_MAX, &error);

    lumi_api_put_array(builder, "boards");
    for (int i = 0; i < count && i < BOARDS_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_board(builder, &boards[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_text(builder, "boards_error", count < 0 ? error.text : "");
}

static void look_for_devices(struct lookup *lookup)
{
    g_autofree struct lumi_camera_identity *cameras = g_new0(struct lumi_camera_identity, CAMERAS_MAX);
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_error error = {0};
    int count = 0;

    if (lookup->options.devices)
        count = lookup->options.devices(lookup->options.context, cameras, CAMERAS_MAX, &error);
    json_builder_begin_object(builder);
    lumi_api_put_array(builder, "cameras");
    for (int i = 0; i < count && i < CAMERAS_MAX; i++) {
        json_builder_begin_object(builder);
        lumi_api_identity(builder, &cameras[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_text(builder, "cameras_error", count < 0 ? error.text : "");
    put_boards(builder);
    json_builder_end_object(builder);
    lookup->answer = lumi_api_finish(builder);
}

void lumi_api_serve_devices(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    (void)body;
    look_up(http, message, look_for_devices);
}

/* ---- captures ---- */

static void put_capture(JsonBuilder *builder, const char *name, const char *path)
{
    struct lumi_capture *capture = NULL;
    struct lumi_capture_info info = {0};
    char title[256] = "", created[64] = "";
    struct lumi_error error = {0};
    int code = lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &error);

    if (code == LUMI_OK)
        code = lumi_capture_info(capture, &info, &error);
    if (code == LUMI_OK)
        code = lumi_capture_get_meta(capture, "title", title, sizeof title, &error);
    if (code == LUMI_OK)
        code = lumi_capture_get_meta(capture, "created", created, sizeof created, &error);
    lumi_capture_close(capture);
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "name", name);
    lumi_api_put_text(builder, "path", path);
    lumi_api_put_text(builder, "title", title);
    lumi_api_put_text(builder, "created", created);
    lumi_api_put_bool(builder, "sealed", info.sealed);
    lumi_api_put_int(builder, "shots", info.shots);
    lumi_api_put_int(builder, "frames", info.frames);
    lumi_api_put_object(builder, "in_state");
    for (int i = 0; i < (int)(sizeof info.in_state / sizeof info.in_state[0]); i++)
        lumi_api_put_int(builder, lumi_frame_state_name((enum lumi_frame_state)i), info.in_state[i]);
    json_builder_end_object(builder);
    lumi_api_put_int(builder, "bytes", info.frame_bytes);
    lumi_api_put_text(builder, "error", code == LUMI_OK ? "" : error.text);
    json_builder_end_object(builder);
}

static int newest_first(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*b)->d_name, (*a)->d_name); /* names begin with the date where nobody chose another */
}

static void look_for_captures(struct lookup *lookup)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    const char *folder = lookup->options.folder;
    struct dirent **entries;
    int count = folder ? scandir(folder, &entries, NULL, newest_first) : 0, put = 0;

    if (count < 0) {
        lookup->code = lumi_fail_errno(&lookup->error, folder, "read");
        return;
    }
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "folder", folder ? folder : "");
    lumi_api_put_array(builder, "captures");
    for (int i = 0; i < count; i++) {
        g_autofree char *path = g_build_filename(folder, entries[i]->d_name, NULL);
        g_autofree char *database = g_build_filename(path, "data", "capture.db", NULL);
        struct stat is;
        if (entries[i]->d_name[0] != '.' && put < CAPTURES_MAX && !stat(database, &is)) {
            put_capture(builder, entries[i]->d_name, path);
            put++;
        }
        free(entries[i]);
    }
    if (folder)
        free(entries);
    json_builder_end_array(builder);
    json_builder_end_object(builder);
    lookup->answer = lumi_api_finish(builder);
}

void lumi_api_serve_captures(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    (void)body;
    look_up(http, message, look_for_captures);
}
