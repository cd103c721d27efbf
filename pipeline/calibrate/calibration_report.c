/* A calibration in words, and as JSON. */
#include "pipeline/calibrate/calibration.h"

#include "pipeline/run/json_put.h"
#include "proto/base/sort.h"

#include <string.h>

#define MM 1000
#define DEGREES (180 / LUMI_PI)
#define WEAK_SHOWN 20

struct of_camera {
    int frames, used, weak, seen, worst;
    double rms, median_moved, median_turned, worst_moved, worst_turned;
};

/* Of one camera of the capture; −1: of all. */
static struct of_camera sum_up(const struct lumi_run *run, const struct lumi_calibration *c, int camera)
{
    g_autofree double *moved = g_new(double, (gsize)run->count), *turned = g_new(double, (gsize)run->count);
    struct of_camera o = {.worst = -1};
    double squares = 0;

    for (int i = 0; i < run->count; i++) {
        const struct lumi_frame_outcome *f = &c->frames[i];
        if (camera >= 0 && run->sources[i].camera != camera)
            continue;
        o.frames++;
        if (!f->used)
            continue;
        moved[o.used] = f->moved_m;
        turned[o.used++] = f->moved_rotation;
        o.weak += f->weak;
        o.seen += f->seen;
        squares += f->rms * f->rms * f->seen;
        if (o.worst < 0 || f->rms > c->frames[o.worst].rms)
            o.worst = i;
    }
    o.rms = o.seen ? sqrt(squares / o.seen) : 0;
    if (o.used > 0) {
        o.median_moved = lumi_sort_median(moved, o.used);
        o.median_turned = lumi_sort_median(turned, o.used);
        o.worst_moved = moved[o.used - 1];
        o.worst_turned = turned[o.used - 1];
    }
    return o;
}

static int first_of_camera(const struct lumi_run *run, int i)
{
    for (int k = 0; k < i; k++)
        if (run->sources[k].camera == run->sources[i].camera)
            return k;
    return i;
}

static void say_cameras(const struct lumi_run *run, const struct lumi_calibration *c, GString *text)
{
    g_string_append(text, "\nCameras: pictures used, of all; points seen a picture; reprojection error, worst picture; "
                          "moved from the capture's poses, median and most\n");
    for (int i = 0; i < run->count; i++) {
        if (first_of_camera(run, i) != i)
            continue;
        struct of_camera o = sum_up(run, c, run->sources[i].camera);
        g_string_append_printf(text, "  %-12s %4d of %4d  %5.0f  %5.2f px", run->sources[i].camera_name, o.used,
                               o.frames, o.used ? (double)o.seen / o.used : 0, o.rms);
        if (o.worst >= 0)
            g_string_append_printf(text, ", %s %.2f px  %6.2f mm %6.3f°, %6.2f mm %6.3f°", run->sources[o.worst].name,
                                   c->frames[o.worst].rms, MM * o.median_moved, DEGREES * o.median_turned,
                                   MM * o.worst_moved, DEGREES * o.worst_turned);
        g_string_append_c(text, '\n');
    }
}

static void say_lenses(const struct lumi_calibration *c, GString *text)
{
    g_string_append(text, "\nLenses: pictures; points seen; share of the picture's cells in which something was seen; "
                          "focal length and centre, before and after\n");
    for (int i = 0; i < c->lens_count; i++) {
        const struct lumi_lens_outcome *l = &c->lenses[i];
        g_string_append_printf(text, "  of %-9s %4d  %6d  %3.0f %%  %.2f → %.2f px, %.2f %.2f → %.2f %.2f%s\n", l->name,
                               l->frames, l->observations, 100 * l->covered, l->before.fx, l->after.fx, l->before.cx,
                               l->before.cy, l->after.cx, l->after.cy,
                               l->self_calibrated ? "  (found from this capture: it did not fit as it was)" : "");
    }
}

static void say_shutter(const struct lumi_run *run, const struct lumi_calibration *c, GString *text)
{
    if (run->parameters.rolling_shutter)
        g_string_append_printf(text,
                               "\nRolling shutter: the rig turned by %.3f° while a picture was read; poses are those "
                               "of the middle rows\n",
                               DEGREES * c->shutter);
}

static bool is_angle(int number)
{
    return number != LUMI_MOUNT_RADIUS && number != LUMI_MOUNT_OFFSET;
}

static void say_mechanism(const struct lumi_calibration *c, GString *text)
{
    const struct lumi_mechanism *m = &c->mechanism;

    if (!c->has_mechanism)
        return;
    g_string_append_printf(text,
                           "\nMechanism, against its profile (± one standard deviation; cameras are beside it by "
                           "%.2f mm and %.3f° an axis)\n",
                           MM * m->position_spread, DEGREES * m->rotation_spread);
    for (int k = 0; k < LUMI_PLATFORM_NUMBERS; k++) {
        double unit = k < LUMI_PLATFORM_LEAN_X ? MM : DEGREES;
        g_string_append_printf(text, "  %-10s %8.3f ± %.3f %s\n", lumi_platform_names[k], unit * m->platform[k],
                               unit * m->platform_sigma[k], k < LUMI_PLATFORM_LEAN_X ? "mm" : "°");
    }
    for (int i = 0; i < m->rig.camera_count; i++) {
        g_string_append_printf(text, "  %-10s", m->rig.cameras[i].name);
        for (int k = 0; k < LUMI_MOUNT_NUMBERS; k++) {
            double unit = is_angle(k) ? DEGREES : MM;
            g_string_append_printf(text, "  %s %.3f ± %.3f %s", lumi_mount_names[k], unit * m->mount[i][k],
                                   unit * m->mount_sigma[i][k], is_angle(k) ? "°" : "mm");
        }
        g_string_append_c(text, '\n');
    }
    double turn[2] = {0, 0}, drop[2] = {0, 0};
    for (int i = 0; i < m->shot_count; i++) {
        turn[0] = fmin(turn[0], m->turn[i]);
        turn[1] = fmax(turn[1], m->turn[i]);
    }
    for (int i = 0; i < m->knot_count; i++) {
        drop[0] = fmin(drop[0], m->drop[i]);
        drop[1] = fmax(drop[1], m->drop[i]);
    }
    g_string_append_printf(text, "  platform's angle: from %.3f to %.3f° beside what was told\n", DEGREES * turn[0],
                           DEGREES * turn[1]);
    if (!m->rig.string.held)
        g_string_append_printf(text, "  arm's fall: from %.3f to %.3f° beside the profile's\n", DEGREES * drop[0],
                               DEGREES * drop[1]);
}

static void say_frames(const struct lumi_run *run, const struct lumi_calibration *c, GString *text)
{
    int shown = 0;

    for (int i = 0; i < run->count; i++)
        if (c->frames[i].used && c->frames[i].weak && shown++ < WEAK_SHOWN)
            g_string_append_printf(text, "%s  %-12s %d points, %.2f mm and %.3f° beside the mechanism\n",
                                   shown == 1 ? "\nWeak pictures: look at these first\n" : "", run->sources[i].name,
                                   c->frames[i].seen, MM * c->frames[i].beside_m,
                                   DEGREES * c->frames[i].beside_rotation);
    if (shown > WEAK_SHOWN)
        g_string_append_printf(text, "  and %d more (report.json)\n", shown - WEAK_SHOWN);
    shown = 0;
    for (int i = 0; i < run->count; i++)
        if (!c->frames[i].used && shown++ < 3 * WEAK_SHOWN)
            g_string_append_printf(text, "%s  %-12s %s\n", shown == 1 ? "\nNot used\n" : "", run->sources[i].name,
                                   c->frames[i].why);
    if (shown > 3 * WEAK_SHOWN)
        g_string_append_printf(text, "  and %d more (report.json)\n", shown - 3 * WEAK_SHOWN);
}

static void say_findings(const struct lumi_calibration *c, GString *text)
{
    for (guint i = 0; i < c->findings->len; i++) {
        const struct lumi_finding *f = &g_array_index(c->findings, struct lumi_finding, i);
        g_string_append_printf(text, "  %s %s.\n", f->what, f->text);
    }
}

char *lumi_calibration_refusal(const struct lumi_calibration *c, const char *why)
{
    GString *text = g_string_new("not calibrated\n\n" TO_LOOK_AT "\n");

    g_string_append_printf(text, "  %s.\n", why);
    say_findings(c, text);
    return g_string_free(text, FALSE);
}

char *lumi_calibration_text(const struct lumi_run *run, const struct lumi_calibration *c)
{
    struct of_camera all = sum_up(run, c, -1);
    GString *text = g_string_new(NULL);

    g_string_append_printf(text, "calibrated %d of %d pictures: %.2f px, moved by %.1f mm and %.2f° (median)", c->used,
                           c->frame_count, c->rms, MM * all.median_moved, DEGREES * all.median_turned);
    if (c->findings->len)
        g_string_append_printf(text, "; %u to look at", c->findings->len);
    g_string_append_printf(text, "\n%d points, %d observations, %d taken out; weak: %d\n", c->solved.points,
                           c->solved.observations, c->solved.outliers, all.weak);
    if (c->refined.matched > 0)
        g_string_append_printf(text,
                               "%d of these places were matched anew in the pictures, %.2f px from where features "
                               "had them (median)\n",
                               c->refined.matched, c->refined.moved);
    if (c->findings->len)
        g_string_append(text, "\n" TO_LOOK_AT "\n");
    say_findings(c, text);
    say_cameras(run, c, text);
    say_lenses(c, text);
    say_shutter(run, c, text);
    say_mechanism(c, text);
    say_frames(run, c, text);
    return g_string_free(text, FALSE);
}

static void put_frames(const struct lumi_run *run, const struct lumi_calibration *c, JsonBuilder *b)
{
    lumi_put_array(b, "frames");
    for (int i = 0; i < run->count; i++) {
        const struct lumi_frame_outcome *f = &c->frames[i];
        json_builder_begin_object(b);
        lumi_put_string(b, "name", run->sources[i].name);
        lumi_put_string(b, "camera", run->sources[i].camera_name);
        lumi_put_bool(b, "used", f->used);
        if (!f->used)
            lumi_put_string(b, "why", f->why);
        lumi_put_int(b, "seen", f->seen);
        lumi_put_double(b, "rms_px", f->rms);
        lumi_put_double(b, "worst_px", f->worst);
        lumi_put_double(b, "moved_mm", MM * f->moved_m);
        lumi_put_double(b, "moved_degrees", DEGREES * f->moved_rotation);
        lumi_put_double(b, "beside_mm", MM * f->beside_m);
        lumi_put_double(b, "beside_degrees", DEGREES * f->beside_rotation);
        lumi_put_bool(b, "weak", f->weak);
        json_builder_end_object(b);
    }
    json_builder_end_array(b);
}

static void put_mechanism(const struct lumi_calibration *c, JsonBuilder *b)
{
    const struct lumi_mechanism *m = &c->mechanism;

    lumi_put_object(b, "mechanism");
    lumi_put_double(b, "position_spread_mm", MM * m->position_spread);
    lumi_put_double(b, "rotation_spread_degrees", DEGREES * m->rotation_spread);
    for (int k = 0; k < LUMI_PLATFORM_NUMBERS; k++)
        lumi_put_double(b, lumi_platform_names[k], (k < LUMI_PLATFORM_LEAN_X ? MM : DEGREES) * m->platform[k]);
    lumi_put_array(b, "cameras");
    for (int i = 0; i < m->rig.camera_count; i++) {
        json_builder_begin_object(b);
        lumi_put_string(b, "name", m->rig.cameras[i].name);
        for (int k = 0; k < LUMI_MOUNT_NUMBERS; k++) {
            g_autofree char *sigma = g_strdup_printf("%s_sigma", lumi_mount_names[k]);
            lumi_put_double(b, lumi_mount_names[k], (is_angle(k) ? DEGREES : MM) * m->mount[i][k]);
            lumi_put_double(b, sigma, (is_angle(k) ? DEGREES : MM) * m->mount_sigma[i][k]);
        }
        json_builder_end_object(b);
    }
    json_builder_end_array(b);
    json_builder_end_object(b);
}

static void put_lenses(const struct lumi_calibration *c, JsonBuilder *b)
{
    lumi_put_array(b, "lenses");
    for (int i = 0; i < c->lens_count; i++) {
        const struct lumi_lens_outcome *l = &c->lenses[i];
        json_builder_begin_object(b);
        lumi_put_string(b, "camera", l->name);
        lumi_put_int(b, "frames", l->frames);
        lumi_put_int(b, "observations", l->observations);
        lumi_put_double(b, "covered", l->covered);
        lumi_put_double(b, "focal_before_px", l->before.fx);
        lumi_put_double(b, "focal_px", l->after.fx);
        lumi_put_bool(b, "self_calibrated", l->self_calibrated);
        json_builder_end_object(b);
    }
    json_builder_end_array(b);
}

char *lumi_calibration_json(const struct lumi_run *run, const struct lumi_calibration *c)
{
    g_autoptr(JsonBuilder) b = json_builder_new();
    struct of_camera all = sum_up(run, c, -1);

    json_builder_begin_object(b);
    lumi_put_int(b, "pictures", c->frame_count);
    lumi_put_int(b, "used", c->used);
    lumi_put_int(b, "weak", all.weak);
    lumi_put_int(b, "points", c->solved.points);
    lumi_put_int(b, "observations", c->solved.observations);
    lumi_put_int(b, "outliers", c->solved.outliers);
    lumi_put_double(b, "rms_px", c->rms);
    lumi_put_double(b, "moved_median_mm", MM * all.median_moved);
    lumi_put_double(b, "moved_median_degrees", DEGREES * all.median_turned);
    lumi_put_array(b, "findings");
    for (guint i = 0; i < c->findings->len; i++) {
        const struct lumi_finding *f = &g_array_index(c->findings, struct lumi_finding, i);
        json_builder_begin_object(b);
        lumi_put_string(b, "what", f->what);
        lumi_put_string(b, "text", f->text);
        lumi_put_int(b, "frames_lost", f->frames_lost);
        json_builder_end_object(b);
    }
    json_builder_end_array(b);
    put_lenses(c, b);
    if (c->has_mechanism)
        put_mechanism(c, b);
    put_frames(run, c, b);
    g_autofree char *text = lumi_put_end(b, TRUE);
    return g_strconcat(text, "\n", NULL);
}
