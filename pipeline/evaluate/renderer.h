/* A field, opened for rendering with one method: what `lumi render` and `lumi eval` share. */
#ifndef LUMI_PIPELINE_EVALUATE_RENDERER_H
#define LUMI_PIPELINE_EVALUATE_RENDERER_H

#include "proto/lightfield/field.h"
#include "render/cpu/disk_renderer.h"
#include "render/cpu/plane_renderer.h"

enum lumi_method { LUMI_METHOD_DISKS = 0, LUMI_METHOD_PLANE = 1 };

struct lumi_render_options {
    enum lumi_method method;
    int level;                       /* enum lumi_field_level */
    struct lumi_disk_settings disks; /* of these, the plane takes filter, linear_light, sample and threads */
    double plane_distance;           /* metres from the field's centre; 0: to be set by lumi_renderer_set_plane */
    size_t cache_bytes;              /* decoded images kept; 0: 1 GiB */
};

void lumi_render_options_default(struct lumi_render_options *options);

struct lumi_renderer;

int lumi_renderer_open(const char *path, const struct lumi_render_options *options, struct lumi_renderer **renderer,
                       struct lumi_error *error);
void lumi_renderer_close(struct lumi_renderer *renderer);

const struct lumi_field *lumi_renderer_field(const struct lumi_renderer *renderer);
int lumi_renderer_damaged(struct lumi_renderer *renderer);

/* Inverse distances between which the field's surfaces lie (1/m), for the search of the best plane. */
void lumi_renderer_range(const struct lumi_renderer *renderer, double *low, double *high);
void lumi_renderer_set_plane(struct lumi_renderer *renderer, double inverse_distance);

int lumi_renderer_draw(struct lumi_renderer *renderer, const struct lumi_lens *lens, const struct lumi_pose *pose,
                       struct lumi_picture *picture, struct lumi_error *error);

#endif
