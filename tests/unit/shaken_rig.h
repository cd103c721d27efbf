/* A rig whose poses are not what its profile says, and points that its cameras see: a bundle with known truth. */
#ifndef LUMI_TESTS_UNIT_SHAKEN_RIG_H
#define LUMI_TESTS_UNIT_SHAKEN_RIG_H

#include "pipeline/calibrate/bundle.h"
#include "pipeline/calibrate/mechanism.h"
#include "pipeline/calibrate/rotation.h"
#include "proto/mechanism/kinematics.h"

#include <stdint.h>
#include <stdlib.h>

struct shaken_settings {
    double systematic;         /* 1: as large as the profile says */
    double position, rotation; /* of each camera by itself: one standard deviation, metres and radians */
    double noise;              /* pixels */
    double wrong;              /* share of the observations that are of something else */
    int points, per_image;
};

struct shaken {
    struct lumi_bundle bundle;
    struct lumi_mechanism mechanism;
    struct lumi_pose *truth;
    uint64_t seed;
};

/* splitmix64 (Steele, Lea, Flood 2014). */
static inline double shaken_unit(struct shaken *s)
{
    uint64_t z = s->seed += 0x9E3779B97F4A7C15u;

    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static inline double shaken_normal(struct shaken *s)
{
    double a = shaken_unit(s), b = shaken_unit(s);

    return sqrt(-2 * log(a)) * cos(2 * LUMI_PI * b);
}

/* On the walls of a room of 6 × 5 × 3 m around the rig, one in ten on hills 200 m away. */
static inline struct lumi_vec3 shaken_place(struct shaken *s)
{
    struct lumi_vec3 d = lumi_vec3(shaken_normal(s), shaken_normal(s), shaken_normal(s));
    double far = fmin(fmin(3 / fabs(d.x), 2.5 / fabs(d.y)), 1.5 / fabs(d.z));

    if (shaken_unit(s) < 0.1)
        return lumi_scale(d, 200 / lumi_length(d));
    return lumi_scale(d, far * (0.7 + 0.3 * shaken_unit(s)));
}

static inline void shaken_rig_errors(struct shaken *s, double size)
{
    struct lumi_mechanism *m = &s->mechanism;
    const double degree = LUMI_PI / 180;
    const double mount[LUMI_MOUNT_NUMBERS] = {0.2 * degree, 0, 0.003, 0, 0.3 * degree, 0.3 * degree, 0.3 * degree};

    for (int i = 0; i < m->rig.camera_count; i++) {
        for (int k = 0; k < LUMI_MOUNT_NUMBERS; k++)
            m->mount[i][k] = size * mount[k] * shaken_normal(s);
        m->mount[i][LUMI_MOUNT_RADIUS] += size * 0.004;
    }
    m->platform[LUMI_PLATFORM_X] = size * 0.002;
    m->platform[LUMI_PLATFORM_LEAN_Y] = size * 0.1 * degree;
    for (int i = 0; i < m->shot_count; i++)
        m->turn[i] = -size * 0.2 * degree * shaken_unit(s);
    for (int i = 0; i < m->knot_count && !m->rig.string.held; i++)
        m->drop[i] = size * 0.3 * degree * sin(5.0 * i / m->knot_count);
}

static inline void shaken_cameras(struct shaken *s, const struct shaken_settings *settings)
{
    struct lumi_mechanism *m = &s->mechanism;
    const struct lumi_rig *rig = &m->rig;
    int index = 0;

    for (int shot = 0; shot < m->shot_count; shot++)
        for (int camera = 0; camera < rig->camera_count; camera++, index++) {
            double turns = (double)shot / rig->positions;
            m->frames[index] = (struct lumi_mechanism_frame){camera, shot, lumi_rig_turn_angle(rig, turns),
                                                             lumi_rig_drop(rig, turns), turns};
        }
    for (int i = 0; i < index; i++) {
        struct lumi_bundle_camera *c = &s->bundle.cameras[i];
        lumi_mechanism_pose(m, i, &c->prior);
        c->used = true;
    }
    shaken_rig_errors(s, settings->systematic);
    for (int i = 0; i < index; i++) {
        struct lumi_pose moved;
        const double w[3] = {settings->rotation * shaken_normal(s), settings->rotation * shaken_normal(s),
                             settings->rotation * shaken_normal(s)};
        lumi_rotation_exp(w, moved.r);
        moved.t = lumi_vec3(settings->position * shaken_normal(s), settings->position * shaken_normal(s),
                            settings->position * shaken_normal(s));
        lumi_mechanism_pose(m, i, &s->truth[i]);
        lumi_pose_multiply(&s->truth[i], &moved, &s->truth[i]);
        s->bundle.cameras[i].pose = s->bundle.cameras[i].prior;
    }
    lumi_mechanism_reset(m);
}

/* Points and where they are seen; a picture takes what it can until it has enough. */
static inline void shaken_observe(struct shaken *s, const struct shaken_settings *settings)
{
    struct lumi_bundle *b = &s->bundle;
    const struct lumi_lens *lens = &b->lenses[0].lens;
    int *taken = calloc((size_t)b->camera_count, sizeof *taken), count = 0, points = 0;

    for (int k = 0; k < settings->points; k++) {
        struct lumi_vec3 place = shaken_place(s);
        int first = count;
        for (int i = 0; i < b->camera_count && count < b->observation_count; i++) {
            double x, y;
            if (taken[i] >= settings->per_image || shaken_unit(s) < 0.3 ||
                !lumi_lens_project(lens, lumi_to_camera(&s->truth[i], place), &x, &y) || x < 0 || y < 0 ||
                x >= lens->width || y >= lens->height)
                continue;
            struct lumi_bundle_observation *o = &b->observations[count++];
            *o = (struct lumi_bundle_observation){.camera = i, .point = points, .sigma = 0.5};
            o->x = x + settings->noise * shaken_normal(s);
            o->y = y + settings->noise * shaken_normal(s);
            if (shaken_unit(s) < settings->wrong)
                o->x += 6 + 10 * shaken_unit(s);
            taken[i]++;
            if (count - first == 12)
                break;
        }
        if (count - first < 2) {
            for (; count > first; count--)
                taken[b->observations[count - 1].camera]--;
            continue;
        }
        b->first[points++] = first;
    }
    b->first[points] = count;
    b->point_count = points;
    b->observation_count = count;
    free(taken);
}

static inline void shaken_init(struct shaken *s, const struct lumi_rig *rig, const struct shaken_settings *settings)
{
    int shots = rig->positions * rig->turns, frames = shots * rig->camera_count;

    *s = (struct shaken){.seed = 7};
    if (lumi_bundle_init(&s->bundle, 1, frames, settings->points, frames * settings->per_image, NULL) ||
        lumi_mechanism_init(&s->mechanism, rig, frames, shots, NULL))
        abort();
    s->truth = calloc((size_t)frames, sizeof *s->truth);
    s->bundle.lenses[0].lens = rig->lenses[rig->cameras[0].lens].lens;
    shaken_cameras(s, settings);
    shaken_observe(s, settings);
}

static inline void shaken_finish(struct shaken *s)
{
    lumi_bundle_finish(&s->bundle);
    lumi_mechanism_finish(&s->mechanism);
    free(s->truth);
}

#endif
