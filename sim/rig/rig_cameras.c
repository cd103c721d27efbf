/* The cameras on the rig: they take a trigger or are busy, lag, jitter, expose, say so, or record a video. */
#include "sim/rig/mechanics_priv.h"

#include "sim/random.h"

#include <math.h>

enum { CHANNEL_JITTER = 31, CHANNEL_PHASE = 32 };
#define BUSY_SHARE 0.95    /* what a camera takes of the busy time its profile grants it */
#define UNFOCUSED_LAG 0.25 /* s, that a camera takes to focus when nobody held its focus line before */

static double jitter(const struct sim_mechanics *m, int camera, uint32_t n)
{
    uint64_t index = (uint64_t)n * LUMI_RIG_CAMERAS + (uint64_t)camera;
    double a = sim_random_unit(sim_random(m->options.seed, index, CHANNEL_JITTER));
    double b = sim_random_unit(sim_random(m->options.seed, index, CHANNEL_JITTER + 100));

    return m->options.camera_jitter * sqrt(-2 * log(a)) * cos(2 * LUMI_PI * b); /* Box and Muller 1958 */
}

static void next_of_all(struct sim_mechanics *m)
{
    m->cameras_next = BOARD_NEVER;
    for (int i = 0; i < m->truth.camera_count; i++)
        m->cameras_next = MIN(m->cameras_next, m->cameras[i].next);
}

static double lag_of(const struct sim_mechanics *m, int index)
{
    const struct sim_camera *camera = &m->cameras[index];
    const struct lumi_rig_trigger *t = &m->truth.control.triggers[index];
    double lag = t->shutter_lag + camera->fault.lag + jitter(m, index, camera->taken);

    if (t->focus_channel >= 0 &&
        (camera->focused_since == BOARD_NEVER || SECONDS(m->now - camera->focused_since) < t->focus_lead * 0.9))
        lag += UNFOCUSED_LAG;
    return fmax(lag, 0);
}

static void trigger(struct sim_mechanics *m, int index)
{
    struct sim_camera *camera = &m->cameras[index];
    struct sim_exposure record = {.camera = index, .trigger = m->now, .field = m->platform.field};
    int n = m->exposure_count ? (int)(camera->taken % (uint32_t)m->exposure_count) : 0;
    double seconds = camera->exposure > 0 ? camera->exposure : m->exposure_count ? m->exposures[n] : 0.004;

    record.exposure = n;
    record.lost = camera->stage != 0 || m->now < camera->busy_until || camera->fault.dead || camera->fault.unplugged;
    if (camera->fault.exposure > 0)
        seconds *= camera->fault.exposure;
    if (!record.lost) {
        camera->begin = record.begin = m->now + TICKS(lag_of(m, index));
        camera->end = record.end = record.begin + TICKS(seconds);
        camera->middle = record.begin + (record.end - record.begin) / 2;
        camera->busy_until =
            record.end + TICKS(BUSY_SHARE * m->truth.control.triggers[index].busy + camera->fault.busy);
        camera->record = (int)m->records->len;
        camera->stage = 1;
        camera->next = camera->begin;
        camera->taken++;
    }
    g_array_append_val(m->records, record);
}

static void record_video(struct sim_mechanics *m, int index, bool on)
{
    struct sim_camera *camera = &m->cameras[index];
    double phase = sim_random_unit(sim_random(m->options.seed, (uint64_t)index, CHANNEL_PHASE));

    camera->recording = on && !camera->fault.dead;
    camera->frames = 0;
    camera->started = m->now + TICKS(m->truth.control.triggers[index].shutter_lag + phase / m->options.video_rate);
    camera->next = camera->recording ? camera->started : BOARD_NEVER;
}

void sim_cameras_lines(struct sim_mechanics *m, uint16_t lines)
{
    uint16_t rising = lines & (uint16_t)~m->lines, falling = m->lines & (uint16_t)~lines;

    m->lines = lines;
    for (int i = 0; i < m->truth.camera_count; i++) {
        const struct lumi_rig_trigger *t = &m->truth.control.triggers[i];
        if (t->focus_channel >= 0 && rising >> t->focus_channel & 1)
            m->cameras[i].focused_since = m->now;
        if (t->channel >= 0 && m->options.video) {
            bool held = m->truth.control.video.record_pulse == 0;
            if (rising >> t->channel & 1)
                record_video(m, i, held || !m->cameras[i].recording);
            else if (held && falling >> t->channel & 1)
                record_video(m, i, false);
        } else if (t->channel >= 0 && rising >> t->channel & 1) {
            trigger(m, i);
        }
        if (t->focus_channel >= 0 && falling >> t->focus_channel & 1)
            m->cameras[i].focused_since = BOARD_NEVER;
    }
    next_of_all(m);
}

static void sync_line(struct sim_mechanics *m, int index, bool active)
{
    int input = m->truth.control.triggers[index].feedback;

    if (input < 0 || input >= LUMI_RIG_FEEDBACKS || m->cameras[index].fault.feedback_off)
        return;
    int before = m->feedback[input];
    m->feedback[input] += active ? 1 : before > 0 ? -1 : 0;
    if ((before > 0) != (m->feedback[input] > 0))
        sim_mechanics_tell(m, true, input, active, m->now);
}

static void film(struct sim_mechanics *m, int index)
{
    struct sim_camera *camera = &m->cameras[index];
    struct sim_video_frame frame = {index, m->now, sim_mechanics_angle(m), sim_mechanics_drop(m),
                                    m->outputs[BOARD_OUT_LAMP]};

    g_array_append_val(m->video, frame);
    camera->frames++;
    camera->next = camera->started + TICKS((double)camera->frames / m->options.video_rate);
}

static void expose(struct sim_mechanics *m, int index)
{
    struct sim_camera *camera = &m->cameras[index];
    struct sim_exposure *record = &g_array_index(m->records, struct sim_exposure, camera->record);

    switch (camera->stage) {
    case 1:
        camera->begin_angle = sim_mechanics_angle(m);
        sync_line(m, index, true);
        camera->next = camera->middle;
        break;
    case 2:
        record->angle = sim_mechanics_angle(m);
        record->drop = sim_mechanics_drop(m);
        record->swing = sim_mechanics_swing(m);
        camera->next = camera->end;
        break;
    default:
        record->moved = sim_mechanics_angle(m) - camera->begin_angle;
        record->done = true;
        sync_line(m, index, false);
        camera->next = BOARD_NEVER;
        camera->stage = -1;
    }
    camera->stage++;
}

void sim_cameras_run(struct sim_mechanics *m)
{
    if (m->cameras_next > m->now)
        return;
    for (int i = 0; i < m->truth.camera_count; i++)
        while (m->cameras[i].next <= m->now) {
            if (m->options.video)
                film(m, i);
            else
                expose(m, i);
        }
    next_of_all(m);
}

const struct sim_exposure *sim_mechanics_exposures(const struct sim_mechanics *m, int *count)
{
    *count = (int)m->records->len;
    return (const struct sim_exposure *)(const void *)m->records->data;
}

const struct sim_video_frame *sim_mechanics_video(const struct sim_mechanics *m, int *count)
{
    *count = (int)m->video->len;
    return (const struct sim_video_frame *)(const void *)m->video->data;
}

void sim_mechanics_set_exposures(struct sim_mechanics *m, const double *seconds, int count)
{
    m->exposure_count = MIN(count, (int)G_N_ELEMENTS(m->exposures));
    for (int i = 0; i < m->exposure_count; i++)
        m->exposures[i] = seconds[i];
    for (int i = 0; i < m->truth.camera_count; i++)
        m->cameras[i].taken = 0;
}

void sim_mechanics_set_camera_exposure(struct sim_mechanics *m, int camera, double seconds)
{
    if (camera >= 0 && camera < LUMI_RIG_CAMERAS)
        m->cameras[camera].exposure = seconds;
}

const struct sim_camera_fault *sim_mechanics_camera_faults(const struct sim_mechanics *m, int camera)
{
    return &m->cameras[camera].fault;
}

void sim_mechanics_camera_fault(struct sim_mechanics *m, int camera, const struct sim_camera_fault *fault)
{
    if (camera >= 0 && camera < LUMI_RIG_CAMERAS)
        m->cameras[camera].fault = *fault;
}
