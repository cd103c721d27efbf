/* An import of cameras' own recordings: which camera's is what, and the steps in order. */
#include "pipeline/exchange/recordings.h"

#include "pipeline/exchange/ingest_film.h"

#include <math.h>
#include <string.h>

void lumi_ingest_options_init(struct lumi_ingest_options *options)
{
    *options = (struct lumi_ingest_options){0};
}

static void clear_finding(void *finding)
{
    g_free(((struct ingest_finding *)finding)->text);
}

static int camera_by_name(const struct ingest *ingest, const char *name)
{
    for (int c = 0; c < ingest->camera_count; c++)
        if (!strcmp(ingest->rig.cameras[c].name, name))
            return c;
    return -1;
}

static int take_named(struct ingest *ingest, struct lumi_error *error)
{
    for (int i = 0; i < ingest->options->source_count; i++) {
        const struct lumi_ingest_source *source = &ingest->options->sources[i];
        int c = camera_by_name(ingest, source->camera);
        if (c < 0)
            return lumi_fail(error, LUMI_ERR_ARG, "--camera %s=%s: the rig '%s' has no camera of this name",
                             source->camera, source->path, ingest->rig.name);
        if (ingest->cameras[c].path)
            return lumi_fail(error, LUMI_ERR_ARG, "--camera %s=%s: %s is named twice", source->camera, source->path,
                             source->camera);
        if (!g_file_test(source->path, G_FILE_TEST_EXISTS))
            return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no such folder", source->path);
        ingest->cameras[c].path = g_strdup(source->path);
    }
    return LUMI_OK;
}

static int by_name(gconstpointer a, gconstpointer b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* "left" for the folder "left" or the video "left.mp4". */
static int take_found(struct ingest *ingest, struct lumi_error *error)
{
    const char *folder = ingest->options->folder, *name;
    g_autoptr(GDir) directory = g_dir_open(folder, 0, NULL);
    g_autoptr(GPtrArray) names = g_ptr_array_new_with_free_func(g_free);

    if (!directory)
        return lumi_fail_errno(error, folder, "reading the folder");
    while ((name = g_dir_read_name(directory)) != NULL)
        if (name[0] != '.')
            g_ptr_array_add(names, g_strdup(name));
    g_ptr_array_sort(names, by_name);
    for (guint i = 0; i < names->len; i++) {
        g_autofree char *path = g_build_filename(folder, names->pdata[i], NULL);
        g_autofree char *stem = g_strdup(names->pdata[i]);
        bool is_folder = g_file_test(path, G_FILE_TEST_IS_DIR);
        if (!is_folder && (!strrchr(stem, '.') || lumi_image_format_of_name(stem) != LUMI_IMAGE_AUTO))
            continue;
        if (!is_folder)
            *strrchr(stem, '.') = '\0';
        int c = camera_by_name(ingest, stem);
        if (c >= 0 && !ingest->cameras[c].path)
            ingest->cameras[c].path = g_steal_pointer(&path);
        else if (is_folder && c < 0)
            ingest_find(
                ingest, "unknown", -1, LUMI_NO_TIME,
                "%s: the rig has no camera '%s': the folder is not used (--camera NAME=FOLDER says whose it is)", path,
                stem);
    }
    return LUMI_OK;
}

/* A file is a video, and so is a folder that holds one and no pictures. All cameras are of one kind. */
static int tell_kinds(struct ingest *ingest, struct lumi_error *error)
{
    int first = -1;

    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        struct lumi_card card;
        if (!camera->path)
            continue;
        camera->video = !g_file_test(camera->path, G_FILE_TEST_IS_DIR);
        if (!camera->video) {
            int code = lumi_card_list(camera->path, &card, error);
            if (code == LUMI_OK && card.files->len == 0 && card.videos->len > 1)
                code = lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                                 "%s: %u videos and no picture: which is meant is said by --camera %s=VIDEO",
                                 camera->path, card.videos->len, ingest->rig.cameras[c].name);
            if (code == LUMI_OK && card.files->len == 0 && card.videos->len == 1) {
                char *video = g_build_filename(camera->path, g_array_index(card.videos, char *, 0), NULL);
                g_free(camera->path);
                camera->path = video;
                camera->video = true;
            }
            lumi_card_finish(&card);
            LUMI_TRY(code);
        }
        first = first < 0 ? c : first;
        if (camera->video != ingest->cameras[first].video)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: %s, but %s: %s; all cameras' must be of one kind",
                             ingest->cameras[first].path, ingest->cameras[first].video ? "a video" : "pictures",
                             camera->path, camera->video ? "a video" : "pictures");
    }
    ingest->videos = ingest->cameras[first].video;
    return LUMI_OK;
}

static int find_sources(struct ingest *ingest, struct lumi_error *error)
{
    int given = 0;

    LUMI_TRY(take_named(ingest, error));
    if (ingest->options->folder)
        LUMI_TRY(take_found(ingest, error));
    for (int c = 0; c < ingest->camera_count; c++)
        given += ingest->cameras[c].path ? 1 : 0;
    if (given == 0)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no folder in it is called as a camera of the rig '%s' ('%s' …)",
                         ingest->options->folder ? ingest->options->folder : "--camera", ingest->rig.name,
                         ingest->rig.cameras[0].name);
    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        if (camera->path && !camera->taking_part)
            camera->taking_part = true;
        if (camera->taking_part && !camera->path)
            ingest_find(ingest, "absent", c, LUMI_NO_TIME,
                        "%s: there is no folder of its pictures: all of its frames are missing (--camera %s=FOLDER)",
                        ingest->rig.cameras[c].name, ingest->rig.cameras[c].name);
    }
    return tell_kinds(ingest, error);
}

void ingest_make_frames(struct ingest *ingest, int c)
{
    ingest->cameras[c].frames = g_new0(struct ingest_frame, ingest->shots.shots);
    for (int s = 0; s < ingest->shots.shots; s++)
        ingest->cameras[c].frames[s] = (struct ingest_frame){.file = -1, .turns = NAN};
}

/* `lumi_plan_cameras` knows those that the board fires; here it is those that record by themselves, too. */
static void set_up(struct ingest *ingest, const struct lumi_ingest_options *options)
{
    ingest->options = options;
    ingest->rig = *options->rig;
    ingest->camera_count = options->rig->camera_count;
    ingest->begin_us = LUMI_NO_TIME;
    if (options->plan)
        ingest->plan = *options->plan;
    else
        lumi_plan_init(&ingest->plan, options->rig);
    ingest->rig.positions = ingest->plan.positions;
    ingest->findings = g_array_new(FALSE, FALSE, sizeof(struct ingest_finding));
    g_array_set_clear_func(ingest->findings, clear_finding);
    for (int c = 0; c < ingest->camera_count; c++)
        ingest->cameras[c].taking_part = ingest->plan.cameras == 0 || ingest->plan.cameras >> c & 1;
}

static void finish(struct ingest *ingest)
{
    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        for (int s = 0; camera->frames && s < ingest->shots.shots; s++)
            g_free(camera->frames[s].reason);
        g_free(camera->frames);
        g_free(camera->path);
        lumi_card_finish(&camera->card);
        ingest_film_finish(camera->film);
    }
    g_array_unref(ingest->findings);
    g_free(ingest);
}

static int check_strict(const struct ingest *ingest, struct lumi_error *error)
{
    if (!ingest->options->strict || ingest->findings->len == 0)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s (and %u more; --strict)",
                     g_array_index(ingest->findings, struct ingest_finding, 0).text, ingest->findings->len - 1);
}

int lumi_ingest(const char *path, const struct lumi_ingest_options *options, struct lumi_error *error)
{
    struct ingest *ingest = g_new0(struct ingest, 1);
    struct lumi_capture *capture = NULL;
    int code;

    set_up(ingest, options);
    if (g_file_test(path, G_FILE_TEST_EXISTS))
        LUMI_GOTO(code, out, lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", path));
    LUMI_GOTO(code, out, find_sources(ingest, error));
    LUMI_GOTO(code, out, ingest->videos ? ingest_films(ingest, error) : ingest_cards(ingest, error));
    if (!ingest->videos)
        LUMI_GOTO(code, out, ingest_find_white(ingest, error));
    LUMI_GOTO(code, out, check_strict(ingest, error));
    LUMI_GOTO(code, out, lumi_capture_create(path, &capture, error));
    LUMI_GOTO(code, out, ingest_write(ingest, capture, error));
    code = lumi_capture_publish(capture, options->date, error);
out:
    lumi_capture_close(capture);
    finish(ingest);
    return code;
}
