/* make_capture PATH: a sealed capture of a small arc, for tests of what reads captures. */
#include "proto/capture/capture.h"
#include "proto/mechanism/kinematics.h"

#include <stdio.h>
#include <string.h>

static int fill(struct lumi_capture *capture, const struct lumi_rig *rig, struct lumi_error *error)
{
    struct lumi_capture_lens lens = {.name = "wide", .lens = rig->lenses[0].lens};
    struct lumi_capture_file file = {.extension = ".jpg", .camera_time_us = LUMI_NO_TIME};
    int64_t lens_id, camera, frame;
    struct lumi_pose pose;
    char name[64];

    file.width = lens.lens.width;
    file.height = lens.lens.height;
    LUMI_TRY(lumi_capture_add_lens(capture, &lens, &lens_id, error));
    for (int c = 0; c < rig->camera_count; c++) {
        LUMI_TRY(lumi_capture_add_camera(capture, rig->cameras[c].name, lens_id, &camera, error));
        for (int p = 0; p < rig->positions; p++) {
            snprintf(name, sizeof name, "%s-%04d", rig->cameras[c].name, p);
            const struct lumi_capture_new_frame add = {name, NULL, camera, 0, 0, c, p};
            LUMI_TRY(lumi_capture_add_frame(capture, &add, &frame, error));
            LUMI_TRY(lumi_capture_store_bytes(capture, frame, name, strlen(name), &file, error));
            lumi_rig_camera_pose(rig, c, (double)p / rig->positions, &pose);
            LUMI_TRY(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "make_capture", error));
        }
    }
    return lumi_capture_publish(capture, "2026-11-23", error);
}

int main(int argc, char **argv)
{
    struct lumi_capture *capture = NULL;
    struct lumi_error error = {0};
    struct lumi_rig rig;
    int code;

    if (argc != 2)
        return 2;
    LUMI_GOTO(code, done, lumi_rig_arc(&rig, 3, 4, 1, 0.35, 16, 12, 1, 1, &error));
    LUMI_GOTO(code, done, lumi_capture_create(argv[1], &capture, &error));
    code = fill(capture, &rig, &error);
done:
    lumi_capture_close(capture);
    if (code != LUMI_OK)
        fprintf(stderr, "make_capture: %s\n", error.text);
    return lumi_exit_status(code);
}
