/* Scripts of what is not as it should be, and a capture's cameras one by one. */
#include "tests/scenario/camera_script.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <stdio.h>
#include <string.h>

struct script_line script_lines[SCRIPT_LINES];
int script_line_count;

static int read_script(const char *path, bool (*setting)(const char *line))
{
    char text[256];
    FILE *file = fopen(path, "r");

    if (!file)
        return -1;
    while (fgets(text, sizeof text, file) && script_line_count < SCRIPT_LINES) {
        struct script_line *line = &script_lines[script_line_count];
        memset(line, 0, sizeof *line);
        if (setting && setting(text))
            continue;
        if (sscanf(text, "%15s %31s %lf %lf", line->what, line->camera, &line->a, &line->b) >= 3)
            script_line_count++;
    }
    fclose(file);
    return 0;
}

const struct script_line *script_find(const char *what, const char *camera, double number)
{
    for (int i = 0; i < script_line_count; i++) {
        const struct script_line *line = &script_lines[i];
        if (!strcmp(line->what, what) && !strcmp(line->camera, camera) && (number < 0 || line->a == number))
            return line;
    }
    return NULL;
}

int camera_script_picture(struct lumi_capture *capture, const struct lumi_capture_frame *frame,
                          struct lumi_raster *bytes, struct lumi_error *error)
{
    struct lumi_raster raster = {0};
    char *path = lumi_capture_join(capture, frame->file);
    int code = lumi_image_read(path, 3, &raster, NULL, error);

    lumi_free(path);
    if (code == LUMI_OK)
        code = lumi_raster_convert(&raster, LUMI_U8, bytes);
    lumi_raster_finish(&raster);
    return code;
}

static int write_profile(const struct camera_script *script, struct lumi_capture *capture, const char *out,
                         struct lumi_error *error)
{
    char path[512], *text;

    LUMI_TRY(lumi_capture_get_profile(capture, &text, error));
    snprintf(path, sizeof path, "%s.rig", out);
    int code = lumi_file_write(path, text, strlen(text), false, error);
    if (code == LUMI_OK && script->begin)
        code = script->begin(out, text, error);
    lumi_free(text);
    return code;
}

int camera_script_run(const struct camera_script *script, int argc, char **argv)
{
    struct lumi_capture *capture = NULL;
    struct lumi_capture_frame *frames = NULL;
    struct lumi_error error = {0};
    char name[LUMI_CAPTURE_NAME];
    int count = 0, code;
    int64_t id;

    if (argc != 4 || read_script(argv[3], script->setting) != 0)
        return 2;
    LUMI_GOTO(code, done, lumi_capture_open(argv[1], LUMI_CAPTURE_READ, &capture, &error));
    LUMI_GOTO(code, done, write_profile(script, capture, argv[2], &error));
    LUMI_GOTO(code, done, lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, &error));
    for (int c = 0; lumi_capture_camera(capture, c, &id, name, &error) == LUMI_OK; c++)
        LUMI_GOTO(code, done, script->write_camera(capture, frames, count, argv[2], name, &error));
done:
    lumi_free(frames);
    lumi_capture_close(capture);
    if (code != LUMI_OK)
        fprintf(stderr, "%s: %s\n", script->program, error.text);
    return lumi_exit_status(code);
}
