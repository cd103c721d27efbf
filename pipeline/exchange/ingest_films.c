/* One video a camera: looked through once for the lamp's turn marks, for how the videos lie to each other, and for
 * pictures that are damaged, doubled or not there; then the pictures nearest to the positions are chosen. */
#include "pipeline/exchange/ingest_film.h"

#include "pipeline/exchange/film_offset.h"
#include "proto/base/parallel.h"
#include "proto/base/sort.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#define COLUMNS 16
#define ROWS 12
#define BLOCKS (COLUMNS * ROWS)
#define CURVES (BLOCKS + 1) /* the last is the whole picture */
#define SOUND_RATE 500.0    /* values a second */
#define MOTION_RATE 50.0
#define SURE 0.25     /* correlation from which an offset is believed, */
#define CLEAR 1.15    /* where it is so many times the next best */
#define LOST 1.5      /* of a picture's time: a longer step lacks a picture */
#define REACH 0.75    /* of a picture's time: how far from its position a picture may be taken, */
#define REACH_BAD 2.0 /* and how far to stand in for one that is damaged or doubled */

/* Looking through */

static int add_picture(struct ingest_film *film, const struct lumi_film_picture *picture, struct lumi_error *error)
{
    struct ingest_picture here = {picture->time, picture->damaged, false, 0};
    float blocks[CURVES] = {0};
    guint count = film->pictures->len;

    LUMI_TRY(lumi_film_blocks(film->film, COLUMNS, ROWS, blocks, error));
    for (int i = 0; i < BLOCKS; i++)
        blocks[BLOCKS] += blocks[i] / BLOCKS;
    if (count > 0) {
        const float *before = &g_array_index(film->blocks, float, (count - 1) * CURVES);
        const struct ingest_picture *last = &g_array_index(film->pictures, struct ingest_picture, count - 1);
        for (int i = 0; i < BLOCKS; i++)
            here.motion += fabs((double)blocks[i] - (double)before[i]) / BLOCKS;
        here.doubled = !memcmp(blocks, before, sizeof blocks);
        if (here.time <= last->time)
            here.time = last->time + 1e-6; /* stamps that stand still or go back: they stay in order */
    }
    g_array_append_val(film->pictures, here);
    g_array_append_vals(film->blocks, blocks, CURVES);
    return LUMI_OK;
}

static int look_through(struct ingest *ingest, int c, struct lumi_error *error)
{
    struct ingest_camera *camera = &ingest->cameras[c];
    struct ingest_film *film = camera->film;
    struct lumi_film_picture picture;
    bool there = true;

    LUMI_TRY(lumi_film_open(camera->path, &film->film, error));
    film->info = *lumi_film_info(film->film);
    while (there) {
        LUMI_TRY(lumi_film_next(film->film, &picture, &there, error));
        if (there)
            LUMI_TRY(add_picture(film, &picture, error));
    }
    film->damage = g_strdup(lumi_film_damage(film->film));
    lumi_film_close(film->film);
    film->film = NULL;
    if (film->pictures->len < 2)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no two pictures in it can be decoded", camera->path);
    if (!film->info.sound)
        return LUMI_OK;
    LUMI_TRY(lumi_film_open(camera->path, &film->film, error));
    int code = lumi_film_sound(film->film, SOUND_RATE, &film->sound, &film->sound_count, NULL);
    lumi_film_close(film->film);
    film->film = NULL;
    (void)code; /* a video whose sound cannot be read has none */
    return LUMI_OK;
}

static int find_marks(const struct ingest *ingest, struct ingest_film *film, struct lumi_error *error)
{
    int count = (int)film->pictures->len, first = ingest->plan.first_turn;
    g_autofree double *times = g_new(double, count);

    for (int i = 0; i < count; i++)
        times[i] = g_array_index(film->pictures, struct ingest_picture, i).time;
    const struct lumi_lamp_curves curves = {times, (const float *)(const void *)film->blocks->data, count, CURVES};
    return lumi_lamp_find(&curves, ingest->rig.control.video.lamp_bit, first, first + ingest->plan.turns, film->marks,
                          error);
}

struct looking {
    struct ingest *ingest;
    pthread_mutex_t lock;
    struct lumi_error *error;
    int failed;
    long done;
};

static int look_one(void *context, int c, int thread)
{
    struct looking *looking = context;
    struct ingest *ingest = looking->ingest;
    struct lumi_error error = {0};
    int code = LUMI_OK;

    (void)thread;
    if (ingest->cameras[c].path)
        code = look_through(ingest, c, &error);
    if (ingest->cameras[c].path && code == LUMI_OK)
        code = find_marks(ingest, ingest->cameras[c].film, &error);
    pthread_mutex_lock(&looking->lock);
    if (code != LUMI_OK && c < looking->failed) {
        looking->failed = c;
        if (looking->error)
            *looking->error = error;
    }
    if (ingest->options->progress)
        ingest->options->progress("looking through videos", ++looking->done, ingest->camera_count);
    pthread_mutex_unlock(&looking->lock);
    return code;
}

/* Marks and offsets */

static int mark_count(const struct ingest *ingest, int c)
{
    int count = 0;

    for (int m = 0; ingest->cameras[c].path && m <= ingest->plan.turns; m++)
        count += ingest->cameras[c].film->marks[m].score > 0 ? 1 : 0;
    return count;
}

/* Of two marks that stand in the wrong order the fainter is something else. */
static void drop_disordered(const struct ingest *ingest, struct ingest_film *film)
{
    for (int m = 1; m <= ingest->plan.turns; m++) {
        struct lumi_lamp_mark *before = &film->marks[m - 1], *mark = &film->marks[m];
        if (mark->score > 0 && before->score > 0 && mark->time <= before->time)
            *(mark->score < before->score ? &mark->score : &before->score) = 0;
    }
}

static float *motion_curve(const struct ingest_film *film, int *count)
{
    int pictures = (int)film->pictures->len, at = 1;
    double begin = g_array_index(film->pictures, struct ingest_picture, 0).time;
    double end = g_array_index(film->pictures, struct ingest_picture, pictures - 1).time;

    *count = (int)fmin((end - begin) * MOTION_RATE, 1e6) + 1;
    float *curve = g_new0(float, *count);
    for (int i = 0; i < *count; i++) {
        double time = begin + i / MOTION_RATE;
        while (at + 1 < pictures && g_array_index(film->pictures, struct ingest_picture, at).time < time)
            at++;
        curve[i] = (float)sqrt(g_array_index(film->pictures, struct ingest_picture, at).motion);
    }
    return curve;
}

static bool is_sure(const struct lumi_film_offset *offset)
{
    return offset->correlation > SURE && offset->correlation > CLEAR * offset->next;
}

/* What is at t of camera `from` is at t + *offset of camera c. The way it was found, NULL: none. */
static const char *find_offset(const struct ingest *ingest, int from, int c, double *offset)
{
    const struct ingest_film *a = ingest->cameras[from].film, *b = ingest->cameras[c].film;
    struct lumi_film_offset found = {0};
    int common = 0;

    *offset = 0;
    for (int m = 0; m <= ingest->plan.turns; m++)
        if (a->marks[m].score > 0 && b->marks[m].score > 0) {
            *offset += b->marks[m].time - a->marks[m].time;
            common++;
        }
    if (common > 0) {
        *offset /= common;
        return "its other turn marks";
    }
    if (a->sound && b->sound)
        lumi_film_find_offset(a->sound, a->sound_count, b->sound, b->sound_count, SOUND_RATE, &found, NULL);
    *offset = found.seconds;
    if (is_sure(&found))
        return "the sound";
    int first_count, second_count;
    g_autofree float *first = motion_curve(a, &first_count), *second = motion_curve(b, &second_count);
    lumi_film_find_offset(first, first_count, second, second_count, MOTION_RATE, &found, NULL);
    *offset = found.seconds + g_array_index(b->pictures, struct ingest_picture, 0).time -
              g_array_index(a->pictures, struct ingest_picture, 0).time;
    return is_sure(&found) ? "the motion in the pictures" : NULL;
}

/* Marks that only other cameras saw. */
static void share_marks(struct ingest *ingest, int reference, int c)
{
    struct ingest_film *film = ingest->cameras[c].film;
    const struct ingest_film *from = ingest->cameras[reference].film;
    const char *name = ingest->rig.cameras[c].name;
    int before = mark_count(ingest, c), missing = 0;
    double offset;

    for (int m = 0; m <= ingest->plan.turns; m++)
        missing += film->marks[m].score <= 0 && from->marks[m].score > 0 ? 1 : 0;
    if (missing == 0)
        return;
    const char *way = find_offset(ingest, reference, c, &offset);
    if (!way) {
        ingest_find(
            ingest, "marks", c, LUMI_NO_TIME,
            "%s: the lamp was seen at %d of %d turn marks, and neither sound nor motion tell how its video lies to "
            "that of %s: its frames are missing",
            name, before, ingest->plan.turns + 1, ingest->rig.cameras[reference].name);
        return;
    }
    for (int m = 0; m <= ingest->plan.turns; m++)
        if (film->marks[m].score <= 0 && from->marks[m].score > 0) {
            film->marks[m] = from->marks[m];
            film->marks[m].time += offset;
        }
    ingest_find(ingest, "marks", c, LUMI_NO_TIME,
                "%s: the lamp was seen at %d of %d turn marks; the others by %s and those of %s (%.3f s apart)", name,
                before, ingest->plan.turns + 1, way, ingest->rig.cameras[reference].name, offset);
}

/* Turn marks that a person has given, in the video of the first camera that has one. */
static void take_given_marks(struct ingest *ingest)
{
    int turns = ingest->plan.turns;
    double first = ingest->options->marks[0], last = ingest->options->marks[1];

    for (int c = 0; c < ingest->camera_count; c++)
        if (ingest->cameras[c].path) {
            for (int m = 0; m <= turns; m++)
                ingest->cameras[c].film->marks[m] =
                    (struct lumi_lamp_mark){ingest->plan.first_turn + m, first + (last - first) * m / turns, 0, 1};
            return;
        }
}

static int join_marks(struct ingest *ingest, struct lumi_error *error)
{
    int reference = -1;

    if (ingest->options->marks[1] > ingest->options->marks[0])
        take_given_marks(ingest);
    for (int c = 0; c < ingest->camera_count; c++) {
        if (!ingest->cameras[c].path)
            continue;
        drop_disordered(ingest, ingest->cameras[c].film);
        if (reference < 0 || mark_count(ingest, c) > mark_count(ingest, reference))
            reference = c;
    }
    if (reference < 0 || mark_count(ingest, reference) < 2)
        return lumi_fail(
            error, LUMI_ERR_FORMAT,
            "%s: the lamp's turn marks are not in it, nor in another camera's video: --marks BEGIN,END says "
            "when the first turn begins and the last ends, in seconds of it",
            reference < 0 ? "--camera" : ingest->cameras[reference].path);
    for (int c = 0; c < ingest->camera_count; c++)
        if (c != reference && ingest->cameras[c].path)
            share_marks(ingest, reference, c);
    return LUMI_OK;
}

/* Choosing */

static double typical_step(const struct ingest_film *film)
{
    g_autoptr(GArray) steps = g_array_new(FALSE, FALSE, sizeof(double));

    for (guint i = 1; i < film->pictures->len; i++) {
        double step = g_array_index(film->pictures, struct ingest_picture, i).time -
                      g_array_index(film->pictures, struct ingest_picture, i - 1).time;
        g_array_append_val(steps, step);
    }
    return lumi_sort_median((double *)(void *)steps->data, (int)steps->len);
}

/* When a position is passed; NaN where one of the turn's marks is not known. */
static double position_time(const struct ingest *ingest, const struct ingest_film *film, int position)
{
    int turn = position / ingest->plan.positions;
    const struct lumi_lamp_mark *begin = &film->marks[turn], *end = &film->marks[turn + 1];

    if (begin->score <= 0 || end->score <= 0)
        return NAN;
    return begin->time + (end->time - begin->time) * (position % ingest->plan.positions) / ingest->plan.positions;
}

/* The picture nearest to `time` that is whole and shows that moment. */
static int nearest(const struct ingest_film *film, double time, double reach)
{
    int best = -1;

    for (int i = 0; i < (int)film->pictures->len; i++) {
        const struct ingest_picture *picture = &g_array_index(film->pictures, struct ingest_picture, i);
        if (picture->time > time + reach)
            break;
        if (picture->damaged || picture->doubled || fabs(picture->time - time) > reach)
            continue;
        if (best < 0 ||
            fabs(picture->time - time) < fabs(g_array_index(film->pictures, struct ingest_picture, best).time - time))
            best = i;
    }
    return best;
}

static void choose_pictures(struct ingest *ingest, int c)
{
    struct ingest_camera *camera = &ingest->cameras[c];
    const struct ingest_film *film = camera->film;
    double step = typical_step(film), end = film->info.duration;
    int last = -1;

    if (film->pictures->len > 0)
        end = g_array_index(film->pictures, struct ingest_picture, film->pictures->len - 1).time;
    for (int s = 0; s < ingest->shots.shots; s++) {
        double time = position_time(ingest, film, s);
        int chosen = isnan(time) ? -1 : nearest(film, time, REACH * step);
        if (chosen < 0 && !isnan(time))
            chosen = nearest(film, time, REACH_BAD * step);
        if (chosen > last) {
            int turn = s / ingest->plan.positions;
            double at = g_array_index(film->pictures, struct ingest_picture, chosen).time;
            double part = (at - film->marks[turn].time) / (film->marks[turn + 1].time - film->marks[turn].time);
            camera->frames[s].file = last = chosen;
            camera->frames[s].turns = ingest->plan.first_turn + turn + part;
        } else if (isnan(time)) {
            camera->frames[s].reason = g_strdup("when its turn began and ended is not known");
        } else if (time <= end) {
            camera->frames[s].reason = g_strdup_printf("the video lacks whole pictures at %.3f s", time);
        }
    }
}

/* Steps that lack pictures, pictures that are there twice or damaged, between the first mark and the last. */
static void find_damage(struct ingest *ingest, int c)
{
    const struct ingest_film *film = ingest->cameras[c].film;
    const char *name = ingest->rig.cameras[c].name;
    double step = typical_step(film), from = INFINITY, to = -INFINITY, first_gap = NAN;
    int lost = 0, doubled = 0, damaged = 0;

    for (int m = 0; m <= ingest->plan.turns; m++)
        if (film->marks[m].score > 0) {
            from = fmin(from, film->marks[m].time);
            to = fmax(to, film->marks[m].time);
        }
    for (guint i = 1; i < film->pictures->len; i++) {
        const struct ingest_picture *picture = &g_array_index(film->pictures, struct ingest_picture, i);
        double gap = picture->time - picture[-1].time;
        if (picture->time < from || picture[-1].time > to)
            continue;
        if (gap > LOST * step && isnan(first_gap))
            first_gap = picture[-1].time;
        lost += gap > LOST * step ? (int)fmin(lround(gap / step) - 1, 1000000) : 0;
        doubled += picture->doubled ? 1 : 0;
        damaged += picture->damaged ? 1 : 0;
    }
    if (lost > 0)
        ingest_find(ingest, "dropped", c, LUMI_NO_TIME, "%s: %d pictures of the video were dropped, first after %.3f s",
                    name, lost, first_gap);
    if (doubled > 0)
        ingest_find(ingest, "doubled", c, LUMI_NO_TIME,
                    "%s: %d pictures of the video are the one before again: not used", name, doubled);
    if (damaged > 0)
        ingest_find(ingest, "damaged", c, LUMI_NO_TIME, "%s: %d pictures of the video are damaged: not used", name,
                    damaged);
    if (film->damage)
        ingest_find(ingest, "damaged", c, LUMI_NO_TIME, "%s: %s: %s", name, ingest->cameras[c].path, film->damage);
    if (film->info.rotation != 0)
        ingest_find(ingest, "rotation", c, LUMI_NO_TIME,
                    "%s: the video asks to be shown turned by %d°: taken as its pixels lie, as the profile's lens is",
                    name, film->info.rotation);
    if (film->info.linearised)
        ingest_find(ingest, "tone", c, LUMI_NO_TIME,
                    "%s: the video is in a tone curve for high contrast (HLG, PQ or a logarithm): taken as sRGB", name);
}

/* What camera could have missed told once, not position by position. */
static void tell_missing(struct ingest *ingest)
{
    for (int c = 0; c < ingest->camera_count; c++) {
        int lost = 0, first = -1;
        for (int s = 0; ingest->cameras[c].path && s < ingest->shots.shots; s++)
            if (ingest->cameras[c].frames[s].reason) {
                first = first < 0 ? s : first;
                lost++;
            }
        if (lost == 0)
            continue;
        g_autofree char *shot = ingest_shot_name(ingest, first);
        ingest_find(ingest, "missing", c, LUMI_NO_TIME, "%s: no picture of %d positions, first of %s: %s",
                    ingest->rig.cameras[c].name, lost, shot, ingest->cameras[c].frames[first].reason);
    }
    ingest_find_missing(ingest);
}

int ingest_films(struct ingest *ingest, struct lumi_error *error)
{
    struct looking looking = {.ingest = ingest, .lock = PTHREAD_MUTEX_INITIALIZER, .error = error, .failed = INT32_MAX};

    ingest->what = "videos";
    ingest->store = ingest_store_picture;
    ingest->shots = (struct lumi_shot_plan){.shots = ingest->plan.positions * ingest->plan.turns, .bracket = 1};
    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_film *film = ingest->cameras[c].film = g_new0(struct ingest_film, 1);
        film->pictures = g_array_new(FALSE, FALSE, sizeof(struct ingest_picture));
        film->blocks = g_array_new(FALSE, FALSE, sizeof(float));
        film->marks = g_new0(struct lumi_lamp_mark, ingest->plan.turns + 1);
        ingest_make_frames(ingest, c);
    }
    LUMI_TRY(lumi_parallel_for(ingest->camera_count, ingest->options->threads, look_one, &looking));
    for (int c = 0; c < ingest->camera_count; c++)
        if (ingest->cameras[c].path)
            LUMI_TRY(ingest_fit_lens(ingest, c, ingest->cameras[c].film->info.width,
                                     ingest->cameras[c].film->info.height, ingest->cameras[c].path, error));
    LUMI_TRY(join_marks(ingest, error));
    for (int c = 0; c < ingest->camera_count; c++)
        if (ingest->cameras[c].path) {
            find_damage(ingest, c);
            choose_pictures(ingest, c);
        }
    tell_missing(ingest);
    return LUMI_OK;
}
