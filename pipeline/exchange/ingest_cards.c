/* Folders of pictures, one a camera: read, laid over the sweep's shots, and what does not fit found. */
#include "pipeline/exchange/ingest_priv.h"

#include "proto/base/parallel.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

/* Reading */

struct reading {
    struct ingest *ingest;
    GArray *files; /* struct lumi_card_file *, of all cameras */
    pthread_mutex_t lock;
    long done;
};

static int read_file(void *context, int index, int thread)
{
    struct reading *reading = context;
    const struct lumi_ingest_options *options = reading->ingest->options;

    (void)thread;
    lumi_card_read(g_array_index(reading->files, struct lumi_card_file *, index), options->trust);
    pthread_mutex_lock(&reading->lock);
    reading->done++;
    if (options->progress)
        options->progress("checking", reading->done, (long)reading->files->len);
    pthread_mutex_unlock(&reading->lock);
    return LUMI_OK;
}

static int read_cards(struct ingest *ingest, struct lumi_error *error)
{
    struct reading reading = {.ingest = ingest, .lock = PTHREAD_MUTEX_INITIALIZER};
    int code = LUMI_OK;

    reading.files = g_array_new(FALSE, FALSE, sizeof(struct lumi_card_file *));
    for (int c = 0; code == LUMI_OK && c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        if (!camera->path)
            continue;
        code = lumi_card_list(camera->path, &camera->card, error);
        for (int i = 0; code == LUMI_OK && i < (int)camera->card.files->len; i++) {
            struct lumi_card_file *file = lumi_card_file(&camera->card, i);
            g_array_append_val(reading.files, file);
        }
    }
    if (code == LUMI_OK && reading.files->len == 0)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there are no pictures in the cameras' folders",
                         ingest->options->folder ? ingest->options->folder : ingest->options->sources[0].path);
    if (code == LUMI_OK)
        code = lumi_parallel_for((int)reading.files->len, ingest->options->threads, read_file, &reading);
    g_array_unref(reading.files);
    return code;
}

/* Pictures of another size than most are of something else. */
static int check_sizes(struct ingest *ingest, int c, struct lumi_error *error)
{
    struct lumi_card *card = &ingest->cameras[c].card;
    int votes = 0;
    const struct lumi_card_file *usual = NULL;

    for (int i = 0; i < (int)card->files->len; i++) {
        const struct lumi_card_file *file = lumi_card_file(card, i);
        if (file->damage)
            continue;
        bool same = usual && file->meta.info.width == usual->meta.info.width &&
                    file->meta.info.height == usual->meta.info.height;
        votes += same ? 1 : -1; /* the majority's, by Boyer and Moore's vote */
        if (votes < 0 || !usual) {
            usual = file;
            votes = 1;
        }
    }
    if (!usual)
        return LUMI_OK;
    for (int i = 0; i < (int)card->files->len; i++) {
        struct lumi_card_file *file = lumi_card_file(card, i);
        if (!file->damage &&
            (file->meta.info.width != usual->meta.info.width || file->meta.info.height != usual->meta.info.height))
            file->damage = g_strdup_printf("%s: the image has %dx%d pixels, the camera's others %dx%d", file->path,
                                           file->meta.info.width, file->meta.info.height, usual->meta.info.width,
                                           usual->meta.info.height);
    }
    return ingest_fit_lens(ingest, c, usual->meta.info.width, usual->meta.info.height, usual->path, error);
}

/* Matching */

/* Files that take part: no copies. Which item is which file goes to `files`. */
static struct lumi_shot_item *list_items(const struct ingest *ingest, const struct lumi_card *card, int *files,
                                         int *count)
{
    struct lumi_shot_item *items = g_new(struct lumi_shot_item, MAX(card->files->len, 1u));

    *count = 0;
    for (int i = 0; i < (int)card->files->len; i++) {
        const struct lumi_card_file *file = lumi_card_file(card, i);
        const struct lumi_image_meta *meta = &file->meta;
        double light = meta->exposure_s * (meta->iso > 0 ? meta->iso : 100);
        if (file->same_as >= 0)
            continue;
        files[*count] = i;
        items[(*count)++] = (struct lumi_shot_item){
            .time = meta->taken_us != 0 ? (double)(meta->taken_us - ingest->begin_us) * 1e-6 : NAN,
            .stops = light > 0 ? log2(light) : NAN,
        };
    }
    return items;
}

/* Brackets that most of the cameras with pictures took. */
static void find_bracket(struct ingest *ingest, const struct lumi_shot_camera *cameras)
{
    int votes[LUMI_SHOT_BRACKET + 1] = {0}, most = 1;
    double offsets[LUMI_SHOT_BRACKET + 1][LUMI_SHOT_BRACKET] = {{0}};

    for (int c = 0; c < ingest->camera_count; c++) {
        double found[LUMI_SHOT_BRACKET] = {0};
        if (cameras[c].count == 0)
            continue;
        int bracket = lumi_shot_find_bracket(cameras[c].items, cameras[c].count, found);
        if (votes[bracket]++ == 0)
            memcpy(offsets[bracket], found, sizeof found);
    }
    for (int k = 2; k <= LUMI_SHOT_BRACKET; k++)
        if (votes[k] > votes[most])
            most = k;
    ingest->shots.bracket = most;
    memcpy(ingest->shots.offsets, offsets[most], sizeof offsets[most]);
}

/* What an item is to its camera's frames. */
static void take_shots(struct ingest *ingest, int c, const struct lumi_shot_camera *match, const int *files)
{
    struct ingest_camera *camera = &ingest->cameras[c];

    for (int i = 0; i < match->count; i++) {
        const struct lumi_card_file *file = lumi_card_file(&camera->card, files[i]);
        if (match->shots[i] < 0)
            continue;
        struct ingest_frame *frame = &camera->frames[match->shots[i]];
        if (file->damage)
            frame->reason = g_strdup(file->damage);
        else
            frame->file = files[i];
    }
}

/* Findings */

static const char *file_name(const struct ingest *ingest, int c, int file)
{
    return lumi_card_file(&ingest->cameras[c].card, file)->name;
}

/* Files [first, last] of items that belong to no shot. */
static void find_surplus(struct ingest *ingest, int c, const struct lumi_shot_camera *match, const int *files,
                         int first, int last)
{
    const char *name = ingest->rig.cameras[c].name;
    bool begins = true, ends = true;
    int before = -1, after = -1;

    for (int i = 0; i < first; i++)
        before = match->shots[i] >= 0 ? match->shots[i] : before;
    for (int i = match->count - 1; i > last; i--)
        after = match->shots[i] >= 0 ? match->shots[i] : after;
    begins = before < 0;
    ends = after < 0;
    g_autofree char *range = first == last
                                 ? g_strdup(file_name(ingest, c, files[first]))
                                 : g_strdup_printf("%s to %s, %d pictures,", file_name(ingest, c, files[first]),
                                                   file_name(ingest, c, files[last]), last - first + 1);
    int64_t time = lumi_card_file(&ingest->cameras[c].card, files[first])->meta.taken_us;
    g_autofree char *shot = ingest_shot_name(ingest, before < 0 ? 0 : before);
    const char *where = begins && ends ? "belongs to no shot"
                        : begins       ? "taken before the sweep"
                                       : "taken after the sweep";
    if (begins || ends)
        ingest_find(ingest, "surplus", c, time, "%s: %s %s: not used", name, range, where);
    else
        ingest_find(ingest, "surplus", c, time, "%s: %s one too many after %s: not used", name, range, shot);
}

static void find_in_card(struct ingest *ingest, int c, const struct lumi_shot_camera *match, const int *files)
{
    const struct lumi_card *card = &ingest->cameras[c].card;
    const char *name = ingest->rig.cameras[c].name;

    for (int i = 0; i < (int)card->files->len; i++) {
        const struct lumi_card_file *file = lumi_card_file(card, i);
        if (file->same_as >= 0)
            ingest_find(ingest, "doubled", c, file->meta.taken_us, "%s: %s is a copy of %s: not used", name, file->name,
                        lumi_card_file(card, file->same_as)->name);
        else if (file->damage)
            ingest_find(ingest, "damaged", c, file->meta.taken_us, "%s: %s", name, file->damage);
    }
    for (int i = 0; i < match->count; i++) {
        int last = i;
        if (match->shots[i] >= 0)
            continue;
        while (last + 1 < match->count && match->shots[last + 1] < 0)
            last++;
        find_surplus(ingest, c, match, files, i, last);
        i = last;
    }
    if (card->paired > 0)
        ingest_find(ingest, "paired", c, LUMI_NO_TIME, "%s: %d JPEG files beside raw files of the same name: not used",
                    name, card->paired);
    if (match->count > 0 && match->by_order)
        ingest_find(ingest, "order", c, LUMI_NO_TIME,
                    "%s: its pictures do not tell when they were taken: matched by their order alone%s", name,
                    match->ambiguous ? ", and there are not as many as shots" : "");
    else if (match->matched < ingest->shots.shots && match->ambiguous)
        ingest_find(
            ingest, "order", c, LUMI_NO_TIME,
            "%s: whether its first or its last shots are missing cannot be told: taken as begun with the others "
            "(clocks that were set together would tell)",
            name);
    else if (match->matched < ingest->shots.shots && match->matched > 0 && match->coarse)
        ingest_find(ingest, "order", c, LUMI_NO_TIME,
                    "%s: its clock tells whole seconds, shots are nearer: which of them are missing is a guess", name);
}

static int match_cards(struct ingest *ingest, struct lumi_shot_camera *cameras, struct lumi_error *error)
{
    ingest->shots.bracket = ingest->options->bracket;
    memcpy(ingest->shots.offsets, ingest->options->offsets, sizeof ingest->shots.offsets);
    if (ingest->options->bracket < 1)
        find_bracket(ingest, cameras);
    ingest->shots.shots = ingest->plan.positions * ingest->plan.turns * ingest->shots.bracket;
    for (int c = 0; c < ingest->camera_count; c++)
        ingest_make_frames(ingest, c);
    return lumi_shot_match(&ingest->shots, cameras, ingest->camera_count, error);
}

/* The earliest time any camera tells: times of items count from it. */
static void find_begin(struct ingest *ingest)
{
    ingest->begin_us = LUMI_NO_TIME;
    for (int c = 0; c < ingest->camera_count; c++)
        for (int i = 0; ingest->cameras[c].path && i < (int)ingest->cameras[c].card.files->len; i++) {
            int64_t taken = lumi_card_file(&ingest->cameras[c].card, i)->meta.taken_us;
            if (taken != 0 && (ingest->begin_us == LUMI_NO_TIME || taken < ingest->begin_us))
                ingest->begin_us = taken / 1000000 * 1000000; /* whole seconds stay whole */
        }
}

static int store_file(struct ingest *ingest, struct lumi_capture *capture, int c, int shot, int64_t frame,
                      struct lumi_error *error)
{
    static const char *const canonical[] = {"", ".jpg", ".png", ".tif", ".exr", ".dng"};
    const struct lumi_card_file *source =
        lumi_card_file(&ingest->cameras[c].card, ingest->cameras[c].frames[shot].file);
    const struct lumi_image_meta *meta = &source->meta;
    const char *dot = strrchr(source->name, '.');
    struct lumi_capture_file file = {
        .extension = lumi_image_format_of_name(source->name) == meta->info.format ? dot : canonical[meta->info.format],
        .width = meta->info.width,
        .height = meta->info.height,
        .exposure_s = meta->exposure_s,
        .iso = meta->iso,
        .camera_time_us = meta->taken_us != 0 ? meta->taken_us : LUMI_NO_TIME,
        .exif = meta->exif,
        .exif_size = meta->exif_size,
        .label = source->path};

    return lumi_capture_store_file(capture, frame, source->path, &file, error);
}

int ingest_cards(struct ingest *ingest, struct lumi_error *error)
{
    struct lumi_shot_camera cameras[LUMI_RIG_CAMERAS] = {0};
    int *files[LUMI_RIG_CAMERAS] = {0};
    int code, matched = 0;

    ingest->what = "cards";
    ingest->store = store_file;
    LUMI_TRY(read_cards(ingest, error));
    find_begin(ingest);
    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        if (!camera->path)
            continue;
        lumi_card_find_copies(&camera->card);
        files[c] = g_new(int, MAX(camera->card.files->len, 1u));
        cameras[c].items = list_items(ingest, &camera->card, files[c], &cameras[c].count);
        cameras[c].shots = g_new(int, MAX(cameras[c].count, 1));
    }
    for (int c = 0; c < ingest->camera_count; c++)
        if (ingest->cameras[c].path)
            LUMI_GOTO(code, out, check_sizes(ingest, c, error));
    LUMI_GOTO(code, out, match_cards(ingest, cameras, error));
    for (int c = 0; c < ingest->camera_count; c++) {
        ingest->cameras[c].match = cameras[c];
        matched += cameras[c].matched;
        if (!ingest->cameras[c].path)
            continue;
        take_shots(ingest, c, &cameras[c], files[c]);
        find_in_card(ingest, c, &cameras[c], files[c]);
    }
    if (matched == 0)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "none of the cameras' pictures is of a shot of the sweep");
    ingest_find_missing(ingest);
out:
    for (int c = 0; c < ingest->camera_count; c++) {
        g_free((void *)(uintptr_t)cameras[c].items);
        g_free(cameras[c].shots);
        g_free(files[c]);
        ingest->cameras[c].match.items = NULL;
        ingest->cameras[c].match.shots = NULL;
    }
    return code;
}
