/* capture_kept PATH: what a capture has kept, a line "SHOT CAMERA" for every frame whose row is committed and whose
 * file is on the disk with its checksum. The capture may be one whose program was killed. */
#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct broken {
    char (*files)[LUMI_CAPTURE_PATH];
    int count, room;
};

static void note(void *context, const char *file, const char *text)
{
    struct broken *broken = context;

    if (broken->count == broken->room) {
        broken->room = broken->room ? 2 * broken->room : 64;
        broken->files = realloc(broken->files, (size_t)broken->room * sizeof *broken->files);
        if (!broken->files)
            abort();
    }
    snprintf(broken->files[broken->count++], LUMI_CAPTURE_PATH, "%s", file);
    fprintf(stderr, "%s: %s\n", file, text);
}

static bool kept(const struct broken *broken, const struct lumi_capture_frame *frame)
{
    for (int i = 0; i < broken->count; i++)
        if (!strcmp(broken->files[i], frame->file))
            return false;
    return frame->file[0] != '\0';
}

static int list(const char *path, const struct broken *broken, struct lumi_error *error)
{
    struct lumi_capture_frame *frames = NULL;
    struct lumi_capture *capture = NULL;
    int count = 0, code;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    code = lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error);
    for (int i = 0; i < count && code == LUMI_OK; i++)
        if (kept(broken, &frames[i]))
            printf("%d %s\n", frames[i].plan_shot, frames[i].camera_name);
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

int main(int argc, char **argv)
{
    struct lumi_verify_result result;
    struct lumi_error error = {0};
    struct broken broken = {0};
    int code;

    if (argc != 2)
        return 2;
    code = lumi_capture_verify(argv[1], note, NULL, &broken, &result, &error);
    if (code == LUMI_OK)
        code = list(argv[1], &broken, &error);
    free(broken.files);
    if (code != LUMI_OK)
        fprintf(stderr, "%s\n", error.text);
    return code != LUMI_OK;
}
