/* The engine's other ports: cameras, lines, judging, handing over, telling. */
#include "daemon/lumid/service_priv.h"

#include <stdlib.h>
#include <string.h>

#include <systemd/sd-daemon.h>

/* ---- cameras and lines ---- */

static void camera_command(void *context, int camera, uint32_t number, const struct lumi_camera_command *command)
{
    lumi_camera_host_command(((struct lumi_service *)context)->hosts[camera], number, command);
}

static void lamp(void *context, bool on)
{
    struct lumi_service *service = context;
    struct lumi_error error = {0};

    for (int i = 0; i < service->config->gpio_count; i++)
        if (service->config->gpio[i].role == LUMI_GPIO_LAMP && lumi_gpio_set(service->gpio, i, on, &error) != LUMI_OK)
            lumi_service_log(4, "%s", error.text);
}

/* ---- judging ---- */

struct judge_task {
    struct lumi_task task;
    struct lumi_service *service;
    struct lumi_engine_judge_job job;
    struct lumi_lens lens;
    struct lumi_lens neighbour_lenses[4];
    struct lumi_judge_numbers numbers;
    struct lumi_judge_picture *picture;
    int code;
    struct lumi_error error;
};

static void judge_work(struct lumi_task *task)
{
    struct judge_task *asked = (struct judge_task *)task;
    const struct lumi_engine_judge_job *job = &asked->job;

    asked->code = lumi_judge_picture_create(job->frame, &asked->picture, &asked->error);
    if (asked->code == LUMI_OK)
        asked->code = lumi_judge_measure(asked->picture, job->lens, &job->pose, job->exposure_s, job->gain,
                                         job->neighbours, job->neighbour_count, &asked->numbers, &asked->error);
    if (asked->code != LUMI_OK) {
        lumi_judge_picture_destroy(asked->picture);
        asked->picture = NULL;
    }
}

static void judge_done(struct lumi_task *task)
{
    struct judge_task *asked = (struct judge_task *)task;

    if (asked->code == LUMI_OK)
        lumi_pictures_sharpness(asked->service->pictures, asked->job.camera, asked->job.shot, asked->numbers.sharpness);
    lumi_engine_judged(asked->service->engine, lumi_service_now(), asked->job.id, asked->code, asked->error.text,
                       asked->code == LUMI_OK ? &asked->numbers : NULL, asked->picture);
}

static void judge(void *context, const struct lumi_engine_judge_job *job)
{
    struct lumi_service *service = context;
    struct judge_task *asked = lumi_service_task(sizeof *asked, judge_work, judge_done);

    asked->service = service;
    asked->job = *job;
    if (job->lens) {
        asked->lens = *job->lens;
        asked->job.lens = &asked->lens;
    }
    for (int i = 0; i < job->neighbour_count; i++)
        if (job->neighbours[i].lens) {
            asked->neighbour_lenses[i] = *job->neighbours[i].lens;
            asked->job.neighbours[i].lens = &asked->neighbour_lenses[i];
        }
    if (!lumi_pool_give(service->judges, &asked->task)) {
        asked->code = lumi_fail(&asked->error, LUMI_ERR_BUSY, "too many frames wait to be judged");
        lumi_inbox_post(service->inbox, &asked->task);
    }
}

/* ---- what becomes of it ---- */

static void hand_over(void *context, const char *capture)
{
    struct lumi_service *service = context;
    struct lumi_error error = {0};

    if (lumi_handover_give(service->handover, capture, false, &error) != LUMI_OK)
        lumi_service_log(3, "%s: it is not handed over: %s", capture, error.text);
}

static void log_told(struct lumi_service *service, const struct lumi_engine_told *told)
{
    const struct lumi_config *config = service->config;
    const char *camera = told->camera >= 0 && told->camera < config->engine.camera_count
                             ? config->engine.cameras[told->camera].name
                             : "";

    switch (told->kind) {
    case LUMI_TALE_STATE:
        lumi_service_log(6, "%s%s%s", lumi_engine_state_name(told->state), told->text[0] ? ": " : "", told->text);
        sd_notifyf(0, "STATUS=%s%s%s", lumi_engine_state_name(told->state), told->text[0] ? ": " : "", told->text);
        break;
    case LUMI_TALE_CHECK:
    case LUMI_TALE_SHOT:
        break;
    case LUMI_TALE_FRAME:
        if (told->text[0] && (told->frame_state == LUMI_FRAME_REJECTED || told->lost))
            lumi_service_log(5, "shot %d%s%s: %s", told->shot, *camera ? " of camera " : "", camera, told->text);
        break;
    case LUMI_TALE_INCIDENT:
        if (*camera && !strstr(told->text, camera))
            lumi_service_log(4, "camera %s: %s", camera, told->text);
        else
            lumi_service_log(4, "%s", told->text);
        break;
    case LUMI_TALE_SEALED:
        lumi_service_log(6, "sealed: %s", told->text);
        break;
    }
}

/* Must not call the engine's doing functions; looking at its status is none. */
static void told(void *context, const struct lumi_engine_told *told)
{
    struct lumi_service *service = context;

    if (!service->engine) /* it is still being made */
        return;
    log_told(service, told);
    if (service->http)
        lumi_http_told(service->http, told);
}

void lumi_service_ports(struct lumi_service *service, struct lumi_engine_ports *ports)
{
    memset(ports, 0, sizeof *ports);
    ports->context = service;
    lumi_service_rig_ports(service, ports);
    ports->camera_command = camera_command;
    ports->lamp = lamp;
    ports->judge = judge;
    ports->picture = lumi_service_picture;
    ports->hand_over = hand_over;
    ports->told = told;
}
