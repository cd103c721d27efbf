/* Views that somebody else placed: from a list of poses, from a capture. */
#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/capture/capture.h"
#include "sim/rigs.h"

#include <string.h>

int sim_rig_add(struct sim_rig *rig, const struct lumi_lens *lens, const struct lumi_pose *pose,
                struct lumi_error *error)
{
    if (!lumi_lens_valid(lens))
        return lumi_fail(error, LUMI_ERR_FORMAT, "view %d: its size or focal length is missing or out of range",
                         rig->count);
    struct sim_view *views = lumi_realloc(rig->views, (size_t)rig->count + 1, sizeof *views);
    if (!views)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for %d views", rig->count + 1);
    rig->views = views;
    views[rig->count] = (struct sim_view){.lens = *lens, .pose = *pose, .column = rig->count, .position = rig->count};
    rig->count++;
    rig->rows = 1;
    rig->columns = rig->count;
    rig->cameras = 1;
    return LUMI_OK;
}

/* What the camera centres lie on, about the origin: the places are simulated, so the rig is where it was put. */
static void measure(struct sim_rig *rig, bool plane)
{
    double sum = 0, x = 0, z = 0, inwards = 0;

    for (int i = 0; i < rig->count; i++) {
        struct lumi_vec3 eye = rig->views[i].pose.t;
        sum += lumi_length(eye);
        x = fmax(x, fabs(eye.x));
        z = fmax(z, fabs(eye.z));
        inwards -= lumi_dot(eye, lumi_axis(&rig->views[i].pose, 2));
    }
    rig->plane = plane;
    rig->half_x = x;
    rig->half_z = z;
    rig->radius = plane ? fmin(x, z) : sum / rig->count;
    rig->inward = !plane && inwards > 0;
}

static int take_frames(struct sim_rig *rig, struct lumi_capture *capture, struct lumi_error *error)
{
    struct lumi_capture_frame *frames;
    char surface[32];
    int count, code;

    LUMI_TRY(lumi_capture_get_meta(capture, "surface", surface, sizeof surface, error));
    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    code = LUMI_OK;
    int rows = 0, columns = 0;
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        const struct lumi_capture_frame *frame = &frames[i];
        if (!frame->has_pose)
            continue;
        code = sim_rig_add(rig, &frame->lens, &frame->pose, error);
        if (code == LUMI_OK && frame->row >= 0 && frame->column >= 0) {
            rig->views[rig->count - 1].row = frame->row;
            rig->views[rig->count - 1].column = frame->column;
            rows = frame->row >= rows ? frame->row + 1 : rows;
            columns = frame->column >= columns ? frame->column + 1 : columns;
        }
    }
    lumi_free(frames);
    if (code == LUMI_OK && rig->count > 0) {
        /* Rows and columns name the views, where every view has a place of its own. */
        if (rows * columns >= rig->count) {
            rig->rows = rows;
            rig->columns = columns;
        }
        measure(rig, !strcmp(surface, "plane"));
    }
    return code;
}

int sim_rig_from_capture(struct sim_rig *rig, const char *path, struct lumi_error *error)
{
    struct lumi_capture *capture;

    *rig = (struct sim_rig){0};
    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    int code = take_frames(rig, capture, error);
    lumi_capture_close(capture);
    if (code == LUMI_OK && rig->count == 0)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: no frame has a pose", path);
    if (code != LUMI_OK)
        sim_rig_finish(rig);
    return code;
}
