/* Views with their poses and depth, in a folder: what pictures made some other way are judged by.
 *
 * DIR/transforms.json (nerfstudio's convention: camera to world, x right, y up, z backward), DIR/images/NAME.png, and
 * DIR/depth/NAME.exr: one float channel Z, metres along the optical axis, infinite where there is only sky. */
#ifndef LUMI_SIM_TRUTH_H
#define LUMI_SIM_TRUTH_H

#include "sim/rigs.h"
#include "sim/scene.h"
#include "sim/sensor.h"

#include <stdbool.h>

enum sim_format { SIM_FORMAT_PNG, SIM_FORMAT_JPEG, SIM_FORMAT_EXR, SIM_FORMAT_DNG /* sensor values */ };

typedef void (*sim_progress_fn)(void *context, int done, int total);

struct sim_output {
    enum sim_format format;
    struct sim_sensor sensor;
    const struct lumi_rig *profile; /* of the views, where `turned` is set */
    double turned;                  /* radians that the platform turns during an exposure */
    bool given_poses;               /* with `turned`: about the views' own poses, which are not what the profile says */
    int threads;                    /* 0: as many as there are */
    const char *depth_dir;          /* where depth maps go; NULL: none (truth: its own folder when `depth` is set) */
    bool depth;
    bool overwrite; /* truth: into a folder that exists */
    sim_progress_fn progress;
    void *context;
};
void sim_output_init(struct sim_output *output);

/* Renders all of `views` into the folder `dir`, transforms.json last. */
int sim_truth_write(const struct sim_scene *scene, const struct sim_rig *views, const struct sim_output *output,
                    const char *dir, struct lumi_error *error);

/* transforms.json alone: the true poses of a capture's frames, by the names they have there ("r00c00"). */
int sim_truth_poses(const struct sim_rig *views, enum sim_format format, const char *path, struct lumi_error *error);
char *sim_frame_name(const struct sim_view *view); /* g_free */

/* The light of one view, linear; released by the caller. If depth_path is not NULL the depth map is written there. */
int sim_view_render(const struct sim_scene *scene, const struct sim_view *view, const struct sim_output *output,
                    const char *depth_path, struct lumi_raster *light, struct lumi_error *error);
/* Such light as the bytes of a picture file; `index` is the frame's number for the sensor, `stops` come on top of its
 * exposure. The light is kept. Release *data with lumi_free. */
int sim_view_encode(const struct lumi_raster *light, int index, double stops, const struct sim_output *output,
                    uint8_t **data, size_t *size, struct lumi_error *error);

const char *sim_format_extension(enum sim_format format);

#endif
