/* golden_capture FOLDER: a capture with everything that version 2 holds, every number exact on any machine. */
#include "proto/capture/capture.h"

#include <stdio.h>
#include <string.h>

static const char profile[] =
    "[rig]\nname = golden\n\n"
    "[drive]\nmotor_steps = 200\nmicrosteps = 16\ngear_motor = 9\ngear_platform = 1\ndirection = 1\nindex_deg = 0\n\n"
    "[sweep]\npositions = 4\nturns = 1\n\n"
    "[string]\nheld = yes\nrun = arc\nlength_m = 1.1\nper_turn_m = 0.275\nhold_m = 0.35\nanchor_m = 0\nhold_angle_deg "
    "= 0\n\n"
    "[uncertainty]\nposition_m = 0.005\nrotation_deg = 0.5\nturn_deg = 0.1\ndrop_deg = 0.5\n\n"
    "[lens wide]\nmodel = fisheye\nwidth = 16\nheight = 12\nfx = 16\nfy = 12\ncx = 8\ncy = 6\nk1 = 0\nk2 = 0\nk3 = "
    "0\nk4 = 0\np1 = 0\np2 = 0\n\n"
    "[camera c00]\nlens = wide\nangle_deg = 45\nazimuth_deg = 0\nradius_m = 0.35\nroll_deg = 0\npan_deg = 0\ntilt_deg "
    "= 0\noffset_m = 0\n\n"
    "[camera c01]\nlens = wide\nangle_deg = -45\nazimuth_deg = 0\nradius_m = 0.35\nroll_deg = 0\npan_deg = 0\ntilt_deg "
    "= 0\noffset_m = 0\n\n";

/* Quarter turns about the vertical, and a tilt of 3-4-5. */
static const struct lumi_pose poses[4] = {
    {{0, 0, 1, -1, 0, 0, 0, -1, 0}, {0.35, 0, 0.125}},
    {{1, 0, 0, 0, 0, 1, 0, -1, 0}, {0, 0.35, 0.125}},
    {{0, 0, -1, 1, 0, 0, 0, -1, 0}, {-0.35, 0, -0.1}},
    {{1, 0, 0, 0, 0.6, 0.8, 0, -0.8, 0.6}, {1e-300, -1.0 / 3, 490.625}},
};

static int add_cameras(struct lumi_capture *capture, int64_t camera[2], struct lumi_error *error)
{
    struct lumi_capture_lens wide = {.name = "wide", .model = "OPENCV_FISHEYE", .parameter_count = 8},
                             long_lens = {.name = "", .model = "OPENCV", .parameter_count = 8};
    const double a[8] = {250.5, 251, 160, 120.25, 0.01, -0.002, 0.0003, -1e-5};
    const double b[8] = {700, 700.125, 161.5, 119, -0.1, 0.02, 0.001, -0.0005};
    int64_t lens;

    memcpy(wide.parameters, a, sizeof a);
    memcpy(long_lens.parameters, b, sizeof b);
    wide.lens = (struct lumi_lens){.model = LUMI_LENS_FISHEYE,
                                   .width = 320,
                                   .height = 240,
                                   .fx = a[0],
                                   .fy = a[1],
                                   .cx = a[2],
                                   .cy = a[3],
                                   .k1 = a[4],
                                   .k2 = a[5],
                                   .k3 = a[6],
                                   .k4 = a[7]};
    long_lens.lens = (struct lumi_lens){.model = LUMI_LENS_BROWN,
                                        .width = 320,
                                        .height = 240,
                                        .fx = b[0],
                                        .fy = b[1],
                                        .cx = b[2],
                                        .cy = b[3],
                                        .k1 = b[4],
                                        .k2 = b[5],
                                        .p1 = b[6],
                                        .p2 = b[7]};
    LUMI_TRY(lumi_capture_add_lens(capture, &wide, &lens, error));
    LUMI_TRY(lumi_capture_add_camera(capture, "c00", lens, &camera[0], error));
    LUMI_TRY(lumi_capture_add_lens(capture, &long_lens, &lens, error));
    return lumi_capture_add_camera(capture, "top-2", lens, &camera[1], error);
}

/* Frame number `i` of camera `camera` in `shot`, brought as far as state `i` says. */
static int add_frame(struct lumi_capture *capture, int i, int64_t camera, int64_t shot, struct lumi_error *error)
{
    const struct lumi_capture_file file = {.extension = i % 2 ? ".jpg" : ".png",
                                           .width = 320,
                                           .height = 240,
                                           .exposure_s = 0.125,
                                           .iso = 100 * (i + 1),
                                           .camera_time_us = 5000000 + i,
                                           .exif = "II*\0\10\0\0\0\0\0",
                                           .exif_size = i % 3 ? 10 : 0};
    char name[16], bytes[16];
    int64_t id, again;

    snprintf(name, sizeof name, "f-%04d", i);
    snprintf(bytes, sizeof bytes, "picture %d", i);
    const struct lumi_capture_new_frame add = {name,     i ? "images/\303\274 1.png" : NULL, camera, 0, shot, i / 3,
                                               i % 3 - 1};
    LUMI_TRY(lumi_capture_add_frame(capture, &add, &id, error));
    if (i < 4)
        LUMI_TRY(lumi_capture_set_pose(capture, id, &poses[3], LUMI_POSE_PRIOR, "mechanism", error));
    if (i < 5)
        LUMI_TRY(
            lumi_capture_set_pose(capture, id, &poses[i % 4], (enum lumi_pose_source)(1 + i % 4), "golden", error));
    if (i == 0)
        return LUMI_OK; /* planned */
    LUMI_TRY(lumi_capture_trigger_frame(capture, id, 4000000 + 250 * i, error));
    if (i == 1)
        return LUMI_OK; /* triggered */
    LUMI_TRY(lumi_capture_store_bytes(capture, id, bytes, strlen(bytes), &file, error));
    if (i == 2)
        return LUMI_OK; /* received */
    LUMI_TRY(lumi_capture_judge_frame(capture, id, i == 3, 0.75, i == 3 ? NULL : "blurred", error));
    return i < 5 ? LUMI_OK : lumi_capture_retake_frame(capture, id, &again, error);
}

/* What version 2 added; the frames are those of add_frame. */
static int add_log(struct lumi_capture *capture, const int64_t camera[2], struct lumi_error *error)
{
    static const struct lumi_capture_device device = {"Acme", "M\303\274hle 5", "0815-4711", "1.2", "gige:0815-4711"};
    static const struct lumi_capture_clock clock = {12, 0.25, -3.5, 0.0009765625, 0.001953125};
    static const struct lumi_capture_judgement judgement = {1.5, 0.0625, 0.125, 0.25, -0.5, 2.75, 0.03125};
    const struct lumi_capture_sweep begun = {0, 1795000000000000, LUMI_NO_TIME, ""},
                                    ended = {0, LUMI_NO_TIME, 1795000030000000, "paused: the disk is slow"},
                                    second = {1, 1795000040000000, LUMI_NO_TIME, ""};
    const struct lumi_capture_incident late = {0, 1795000001500000, "late", camera[1], 2, "by 3 s"},
                                       full = {0, LUMI_NO_TIME, "disk", 0, 0, "full"};

    LUMI_TRY(lumi_capture_set_device(capture, camera[0], &device, error));
    LUMI_TRY(lumi_capture_set_sweep(capture, &begun, error));
    LUMI_TRY(lumi_capture_set_sweep(capture, &ended, error));
    LUMI_TRY(lumi_capture_set_sweep(capture, &second, error));
    LUMI_TRY(lumi_capture_set_clock(capture, 0, camera[1], &clock, error));
    LUMI_TRY(lumi_capture_set_shot(capture, 1, 5, -1, error));
    LUMI_TRY(lumi_capture_fire_shot(capture, 4, 0, error));
    LUMI_TRY(lumi_capture_expose_frame(capture, 4, 4000999, error));
    LUMI_TRY(lumi_capture_set_judgement(capture, 4, &judgement, error));
    LUMI_TRY(lumi_capture_add_incident(capture, &late, error));
    return lumi_capture_add_incident(capture, &full, error);
}

static int fill(struct lumi_capture *capture, struct lumi_error *error)
{
    static const char plan[] = "{\"rows\": 2, \"name\": \"M\303\274hle\"}";
    int64_t camera[2], position, shot;

    LUMI_TRY(lumi_capture_set_meta(capture, "surface", "sphere", error));
    LUMI_TRY(lumi_capture_set_meta(capture, "source", "golden_capture", error));
    LUMI_TRY(lumi_capture_set_profile(capture, profile, error));
    LUMI_TRY(lumi_capture_set_plan(capture, plan, error));
    LUMI_TRY(add_cameras(capture, camera, error));
    LUMI_TRY(lumi_capture_begin(capture, error));
    for (int i = 0; i < 6; i++) {
        const struct lumi_capture_position place = {5 - i, i / 4, -7200 + i, 0.5 * i, 0.0625};
        LUMI_TRY(lumi_capture_add_position(capture, &place, &position, error));
        LUMI_TRY(lumi_capture_add_shot(capture, position, 0, i % 2 ? -1.5 : 0, &shot, error));
        LUMI_TRY(add_frame(capture, i, camera[i % 2], shot, error));
    }
    LUMI_TRY(add_log(capture, camera, error));
    LUMI_TRY(lumi_capture_commit(capture, error));
    return lumi_capture_publish(capture, "2026-11-23", error);
}

int main(int argc, char **argv)
{
    struct lumi_capture *capture = NULL;
    struct lumi_error error = {0};

    if (argc != 2)
        return 2;
    int code = lumi_capture_create(argv[1], &capture, &error);
    if (code == LUMI_OK)
        code = fill(capture, &error);
    lumi_capture_close(capture);
    if (code != LUMI_OK)
        fprintf(stderr, "golden_capture: %s\n", error.text);
    return lumi_exit_status(code);
}
