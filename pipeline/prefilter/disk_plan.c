/* What the prefilter of a view reads. */
#include "pipeline/prefilter/disk_plan.h"

#include "pipeline/geometry/disks.h"
#include "pipeline/prefilter/aperture.h"

#include <glib.h>
#include <math.h>

int prefilter_plan_make(const struct lumi_run *run, struct prefilter_plan *plan, struct lumi_error *error)
{
    g_autofree struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)run->count);
    g_autofree struct lumi_disk *disks = g_new(struct lumi_disk, (gsize)run->count);
    int code;

    plan->dense = g_new0(struct lumi_disk, (gsize)run->count);
    plan->kept = g_new0(struct lumi_disk, (gsize)run->count);
    for (int i = 0; i < run->count; i++)
        poses[i] = run->sources[i].pose;
    LUMI_GOTO(code, failed,
              lumi_disks_make(run->count, poses, run->surface, run->centre, run->radius, 1, plan->dense, error));
    for (int i = 0; i < run->kept_count; i++)
        poses[i] = run->sources[run->kept[i]].pose;
    LUMI_GOTO(code, failed,
              lumi_disks_make(run->kept_count, poses, run->surface, run->centre, run->radius,
                              run->parameters.disk_scale, disks, error));
    for (int i = 0; i < run->kept_count; i++)
        plan->kept[run->kept[i]] = disks[i];
    return LUMI_OK;
failed:
    prefilter_plan_finish(plan);
    return code;
}

void prefilter_plan_finish(struct prefilter_plan *plan)
{
    g_clear_pointer(&plan->dense, g_free);
    g_clear_pointer(&plan->kept, g_free);
}

static double largest(double a, double b, double c, double d)
{
    return fmax(fmax(fabs(a), fabs(b)), fmax(fabs(c), fabs(d)));
}

/* Along one axis of the dense view's frame: m is the distance between the centres, `out` what its plane can lie off the
 * rays' eyes, `tangent` the steepest ray it pictures. */
static bool in_reach(double m, double radius, double out, double tangent, double extent)
{
    /* What is near is met at other tangents than the ray's own, by a quarter at most. */
    return fabs(m) - radius - out * 1.25 * tangent <= extent;
}

int prefilter_sources(const struct lumi_run *run, const struct prefilter_plan *plan, int index, int *sources)
{
    const struct lumi_grid *grid = &run->grid;
    const struct lumi_pose *own = &run->sources[index].pose;
    const struct lumi_disk *disk = &plan->kept[index];
    const double radius = largest(disk->u_neg, disk->u_pos, disk->v_neg, disk->v_pos);
    const double across = largest(grid->tan_x[0], grid->tan_x[grid->cols], 0, 0);
    const double down = largest(grid->tan_y[0], grid->tan_y[grid->rows], 0, 0);
    int count = 0;

    for (int i = 0; i < run->count; i++) {
        const struct lumi_pose *other = &run->sources[i].pose;
        const struct lumi_disk *d = &plan->dense[i];
        const double along = lumi_dot(lumi_axis(own, 2), lumi_axis(other, 2));
        const struct lumi_vec3 m = lumi_to_camera(other, own->t);
        const double out = fabs(m.z) + radius * sqrt(fmax(0, 1 - along * along));
        if (along > 0 && in_reach(m.x, radius, out, across, fmax(d->u_neg, d->u_pos)) &&
            in_reach(m.y, radius, out, down, fmax(d->v_neg, d->v_pos)))
            sources[count++] = i;
    }
    return count;
}

enum { LATTICE = 12 }; /* rays a side */

static bool sample_sees(const struct lumi_prefilter_view *view, const struct lumi_view *dense,
                        const struct prefilter_sample *sample)
{
    const struct lumi_vec3 eye = lumi_to_world(&view->pose, lumi_vec3(sample->u, sample->v, 0));
    const struct lumi_vec3 m = lumi_to_camera(&dense->pose, eye);
    const struct lumi_raster *surface = view->surface;

    for (int i = 0; i < LATTICE * LATTICE; i++) {
        const int x = (i % LATTICE) * (surface->width - 1) / (LATTICE - 1);
        const int y = (i / LATTICE) * (surface->height - 1) / (LATTICE - 1);
        const double w = lumi_row_f32(surface, y)[x];
        double tx, ty;
        lumi_grid_unproject(view->grid, x + 0.5, y + 0.5, &tx, &ty);
        const struct lumi_vec3 d = lumi_rotate_back(
            dense->pose.r, lumi_rotate(view->pose.r, lumi_vec3(tx - w * sample->u, ty - w * sample->v, 1)));
        if (d.z > 0 && lumi_disk_weight(&dense->disk, view->shape, view->kernel, 1.1f, (float)(m.x - m.z * d.x / d.z),
                                        (float)(m.y - m.z * d.y / d.z)) > 0)
            return true;
    }
    return false;
}

bool prefilter_sees(const struct lumi_prefilter_view *view, const struct lumi_view *dense, uint32_t seed, int count)
{
    g_autofree struct prefilter_sample *samples = g_new(struct prefilter_sample, (gsize)count);

    if (prefilter_samples(view, seed, count, samples) != LUMI_OK)
        return true;
    for (int i = 0; i < count; i++)
        if (sample_sees(view, dense, &samples[i]))
            return true;
    return false;
}
