/* Gains, brackets, faults. */
#include "sim/takes.h"

#include "sim/random.h"
#include "sim/tripod.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum purpose { CAMERA_GAIN = 100, FRAME_CHANCE, FRAME_GAIN, SHUTTER };

static const struct {
    const char *name;
    int names; /* that stand behind its "=" */
} kinds[] = {
    [SIM_FAULT_UNFOCUSED] = {"unfocused", 1},
    [SIM_FAULT_BLACK] = {"black", 1},
    [SIM_FAULT_SWAPPED] = {"swapped", 2},
    [SIM_FAULT_BACKWARDS] = {"backwards", 0},
    [SIM_FAULT_MISSING_ROW] = {"missing-row", 1},
    [SIM_FAULT_ISOLATED] = {"isolated", 1},
    [SIM_FAULT_UNEQUAL_BRACKETS] = {"unequal-brackets", 0},
};

static double unit(uint64_t seed, int index, unsigned channel)
{
    return sim_random_unit(sim_random(seed, (uint64_t)index, channel));
}

/* Nearly normal, and never far off: the sum of twelve (Irwin and Hall). */
static double about(uint64_t seed, int index, unsigned channel)
{
    double sum = -6;

    for (unsigned i = 0; i < 12; i++)
        sum += unit(seed, index, channel * 16 + i);
    return sum;
}

int sim_takes_add_fault(struct sim_takes *takes, const char *text, struct lumi_error *error)
{
    const char *equals = strchr(text, '=');
    size_t length = equals ? (size_t)(equals - text) : strlen(text), k = 0;
    g_auto(GStrv) names = g_strsplit(equals ? equals + 1 : "", ":", -1);
    int count = (int)g_strv_length(names);

    if (takes->fault_count == SIM_FAULTS)
        return lumi_fail(error, LUMI_ERR_ARG, "fault %s: at most %d faults wanted", text, SIM_FAULTS);
    while (k < G_N_ELEMENTS(kinds) && (strlen(kinds[k].name) != length || strncmp(kinds[k].name, text, length) != 0))
        k++;
    bool fits = k < G_N_ELEMENTS(kinds) && count == kinds[k].names;
    for (int i = 0; fits && i < count; i++)
        fits = *names[i] && strlen(names[i]) < LUMI_RIG_NAME;
    if (!fits)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "fault '%s': unfocused=CAMERA, black=FRAME, swapped=CAMERA:CAMERA, backwards, "
                         "missing-row=ROW, isolated=CAMERA or unequal-brackets wanted",
                         text);
    struct sim_fault *fault = &takes->faults[takes->fault_count++];
    *fault = (struct sim_fault){.kind = (enum sim_fault_kind)k};
    g_strlcpy(fault->first, count > 0 ? names[0] : "", sizeof fault->first);
    g_strlcpy(fault->second, count > 1 ? names[1] : "", sizeof fault->second);
    return LUMI_OK;
}

bool sim_takes_has(const struct sim_takes *takes, enum sim_fault_kind kind)
{
    for (int i = 0; i < takes->fault_count; i++)
        if (takes->faults[i].kind == kind)
            return true;
    return false;
}

/* −1: there is none. */
static int find_camera(const struct sim_rig *rig, const char *name)
{
    for (int i = 0; rig->mechanism && i < rig->cameras; i++)
        if (!strcmp(rig->profile.cameras[i].name, name))
            return i;
    return -1;
}

static bool is_frame(const struct sim_view *view, const char *name)
{
    char text[32];

    snprintf(text, sizeof text, "r%02dc%02d", view->row, view->column);
    return !strcmp(text, name);
}

static int check_frame(const struct sim_rig *rig, const struct sim_fault *fault, struct lumi_error *error)
{
    for (int i = 0; i < rig->count; i++)
        if (fault->kind == SIM_FAULT_BLACK ? is_frame(&rig->views[i], fault->first)
                                           : rig->views[i].row == atoi(fault->first))
            return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_ARG, "fault %s: the rig has no %s", kinds[fault->kind].name, fault->first);
}

static int check_camera(const struct sim_rig *rig, const struct sim_fault *fault, const char *name,
                        struct lumi_error *error)
{
    if (find_camera(rig, name) >= 0)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_ARG, "fault %s: the rig has no camera %s", kinds[fault->kind].name, name);
}

/* The cameras of a position stand side by side in the list of views. */
static void swap(struct sim_rig *rig, int a, int b)
{
    for (int i = 0; i + rig->cameras <= rig->count; i += rig->cameras) {
        struct lumi_pose pose = rig->views[i + a].pose;
        rig->views[i + a].pose = rig->views[i + b].pose;
        rig->views[i + b].pose = pose;
    }
}

int sim_takes_apply(const struct sim_takes *takes, struct sim_rig *rig, struct lumi_error *error)
{
    for (int i = 0; i < takes->fault_count; i++) {
        const struct sim_fault *fault = &takes->faults[i];
        switch (fault->kind) {
        case SIM_FAULT_BLACK:
        case SIM_FAULT_MISSING_ROW:
            LUMI_TRY(check_frame(rig, fault, error));
            break;
        case SIM_FAULT_SWAPPED:
            LUMI_TRY(check_camera(rig, fault, fault->second, error));
            LUMI_TRY(check_camera(rig, fault, fault->first, error));
            swap(rig, find_camera(rig, fault->first), find_camera(rig, fault->second));
            break;
        case SIM_FAULT_UNFOCUSED:
        case SIM_FAULT_ISOLATED:
            LUMI_TRY(check_camera(rig, fault, fault->first, error));
            break;
        case SIM_FAULT_UNEQUAL_BRACKETS:
            if (takes->bracket_count < 2)
                return lumi_fail(error, LUMI_ERR_ARG, "fault unequal-brackets: --brackets is wanted");
            break;
        case SIM_FAULT_BACKWARDS:
            break;
        }
    }
    return LUMI_OK;
}

void sim_takes_shot(const struct sim_takes *t, const struct sim_rig *rig, int index, int shot, struct sim_take *take)
{
    const struct sim_view *view = &rig->views[index];
    double off = t->bracket_count > 0 ? log2(1 + 0.03 * about(t->seed, index * SIM_BRACKET + shot, SHUTTER)) : 0;
    double asked = t->bracket_count > 0 ? t->brackets[shot] : 0;

    *take = (struct sim_take){.stops = asked + off, .exposure_s = t->base_s * exp2(asked + off)};
    if (t->gain > 0) {
        take->stops += t->gain * about(t->seed, view->camera, CAMERA_GAIN);
        if (unit(t->seed, index, FRAME_CHANCE) < 0.125)
            take->stops += 0.5 * t->gain * about(t->seed, index, FRAME_GAIN);
    }
    for (int i = 0; i < t->fault_count; i++) {
        const struct sim_fault *fault = &t->faults[i];
        if (fault->kind == SIM_FAULT_MISSING_ROW && view->row == atoi(fault->first))
            take->lost = true;
        if (fault->kind == SIM_FAULT_UNEQUAL_BRACKETS && view->position % 5 == 4 && shot == t->bracket_count - 1)
            take->lost = true;
    }
}

/* A box of 2 r + 1 pixels along x, twice for each axis: nearly what a lens out of focus does. `line` holds a row. */
static void blur_line(float *first, size_t step, int count, int r, float *line)
{
    for (int i = 0; i < count; i++)
        line[i] = first[(size_t)i * step];
    for (int i = 0; i < count; i++) {
        int low = i - r < 0 ? 0 : i - r, high = i + r >= count ? count - 1 : i + r;
        double sum = 0;
        for (int k = low; k <= high; k++)
            sum += line[k];
        first[(size_t)i * step] = (float)(sum / (high - low + 1));
    }
}

static void blur(struct lumi_raster *picture, int r)
{
    g_autofree float *line = g_new(float, (size_t)MAX(picture->width, picture->height));
    const size_t channels = (size_t)picture->channels;

    for (int pass = 0; pass < 2; pass++)
        for (size_t c = 0; c < channels; c++) {
            for (int y = 0; y < picture->height; y++)
                blur_line(lumi_row_f32(picture, y) + c, channels, picture->width, r, line);
            for (int x = 0; x < picture->width; x++)
                blur_line((float *)picture->data + (size_t)x * channels + c, picture->stride / sizeof(float),
                          picture->height, r, line);
        }
}

static void mirror(struct lumi_raster *picture)
{
    for (int y = 0; y < picture->height; y++) {
        float *row = lumi_row_f32(picture, y);
        for (int a = 0, b = picture->width - 1; a < b; a++, b--)
            for (int c = 0; c < picture->channels; c++) {
                float *left = &row[a * picture->channels + c], *right = &row[b * picture->channels + c], kept = *left;
                *left = *right;
                *right = kept;
            }
    }
}

void sim_takes_disturb(const struct sim_takes *takes, const struct sim_rig *rig, int index, struct lumi_raster *picture)
{
    const struct sim_view *view = &rig->views[index];

    if (takes->arm)
        sim_arm_draw(&view->lens, picture);
    for (int i = 0; i < takes->fault_count; i++) {
        const struct sim_fault *fault = &takes->faults[i];
        bool camera = rig->mechanism && !strcmp(rig->profile.cameras[view->camera].name, fault->first);
        if (fault->kind == SIM_FAULT_BLACK && is_frame(view, fault->first))
            memset(picture->data, 0, picture->stride * (size_t)picture->height);
        if (fault->kind == SIM_FAULT_UNFOCUSED && camera)
            blur(picture, MAX(picture->width / 40, 1));
        if (fault->kind == SIM_FAULT_ISOLATED && camera)
            mirror(picture);
    }
}
