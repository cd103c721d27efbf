/* The images of a capture as the pipeline sees them. */
#include "pipeline/run/sources.h"

#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <glib.h>
#include <string.h>

static int take_frame(const struct lumi_capture *capture, const struct lumi_capture_frame *frame,
                      struct lumi_source *source, struct lumi_error *error)
{
    char *path = lumi_capture_join(capture, frame->file);

    if (!path)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", lumi_capture_path(capture));
    if (!lumi_lens_valid(&frame->lens) || !lumi_pose_valid(&frame->pose, 1e-3)) {
        int code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: its lens or its pose is no lens or no pose", path);
        lumi_free(path);
        return code;
    }
    source->path = g_strdup(path);
    lumi_free(path);
    g_strlcpy(source->name, frame->name, sizeof source->name);
    g_strlcpy(source->sha256, frame->sha256, sizeof source->sha256);
    source->lens = frame->lens;
    source->pose = frame->pose;
    lumi_rotation_orthonormalize(source->pose.r);
    source->row = frame->row;
    source->column = frame->column;
    return LUMI_OK;
}

int lumi_sources_load(struct lumi_run *run, struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    struct lumi_capture_frame *frames = NULL;
    int count = 0, code;

    LUMI_GOTO(code, out, lumi_capture_open(run->capture, LUMI_CAPTURE_READ, &capture, error));
    LUMI_GOTO(code, out, lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    run->sources = g_new0(struct lumi_source, count ? count : 1);
    for (int i = 0; i < count; i++)
        if (frames[i].has_pose) {
            LUMI_GOTO(code, out, take_frame(capture, &frames[i], &run->sources[run->count], error));
            run->count++;
        }
    if (run->count == 0)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: %s", run->capture,
                         count ? "none of its frames has a pose" : "it holds no frame");
out:
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}
