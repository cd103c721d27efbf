/* The engine's ports to the board and the drive: what blocks is done in pools. */
#include "daemon/lumid/service_priv.h"
#include "daemon/rig/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ANSWER_SECONDS 10.0 /* of the board; an erase of its flash takes two */

/* ---- requests ---- */

struct request_task {
    struct lumi_task task;
    struct lumi_service *service;
    uint32_t number;
    bool unheard; /* nobody waits for it */
    lumi_wire_Request request;
    lumi_wire_Reply reply;
    int code;
    struct lumi_error error;
};

static void request_work(struct lumi_task *task)
{
    struct request_task *asked = (struct request_task *)task;

    asked->code =
        lumi_rig_link_command(asked->service->link, &asked->request, ANSWER_SECONDS, &asked->reply, &asked->error);
}

static void request_done(struct lumi_task *task)
{
    struct request_task *asked = (struct request_task *)task;

    if (!asked->unheard)
        lumi_engine_rig_reply(asked->service->engine, lumi_service_now(), asked->number, asked->code, asked->error.text,
                              asked->code == LUMI_OK ? &asked->reply : NULL);
}

/* Where there is no room the answer comes from the loop, not out of the engine's own call. */
static void give(struct lumi_pool *pool, struct lumi_service *service, struct lumi_task *task, int *code,
                 struct lumi_error *error)
{
    if (lumi_pool_give(pool, task))
        return;
    *code = lumi_fail(error, LUMI_ERR_BUSY, "too much is asked of it at once");
    lumi_inbox_post(service->inbox, task);
}

static void request(void *context, uint32_t number, const lumi_wire_Request *request)
{
    struct lumi_service *service = context;
    struct request_task *asked = lumi_service_task(sizeof *asked, request_work, request_done);

    asked->service = service;
    asked->number = number;
    asked->request = *request;
    give(service->requests, service, &asked->task, &asked->code, &asked->error);
}

void lumi_service_rest(struct lumi_service *service)
{
    atomic_store(&service->drive_cancel, true);
    if (service->drive_busy)
        return;
    struct request_task *asked = lumi_service_task(sizeof *asked, request_work, request_done);
    asked->service = service;
    asked->unheard = true;
    asked->request.which_command = lumi_wire_Request_pause_tag;
    give(service->requests, service, &asked->task, &asked->code, &asked->error);
}

/* ---- the profile ---- */

struct profile_task {
    struct lumi_task task;
    struct lumi_service *service;
    uint32_t number;
    struct lumi_rig rig;
    int code;
    struct lumi_error error;
};

static void profile_work(struct lumi_task *task)
{
    struct profile_task *asked = (struct profile_task *)task;

    asked->code = lumi_rig_bench_read_profile(asked->service->link, &asked->rig, &asked->error);
}

static void profile_done(struct lumi_task *task)
{
    struct profile_task *asked = (struct profile_task *)task;

    lumi_engine_rig_profile(asked->service->engine, lumi_service_now(), asked->number, asked->code, asked->error.text,
                            asked->code == LUMI_OK ? &asked->rig : NULL);
}

static void read_profile(void *context, uint32_t number)
{
    struct lumi_service *service = context;
    struct profile_task *asked = lumi_service_task(sizeof *asked, profile_work, profile_done);

    asked->service = service;
    asked->number = number;
    give(service->requests, service, &asked->task, &asked->code, &asked->error);
}

void lumi_service_read_profile(struct lumi_service *service)
{
    service->profile_asked = true;
    read_profile(service, 0);
}

/* ---- at once ---- */

static void stored(void *context, const lumi_wire_Event *event)
{
    lumi_rig_link_stored(((struct lumi_service *)context)->link, event);
}

static void emergency_stop(void *context)
{
    lumi_service_stop_at_once(context);
}

static int64_t to_host(void *context, uint64_t board_ns)
{
    return (int64_t)lumi_rig_link_to_host(((struct lumi_service *)context)->link, board_ns);
}

/* ---- the drive ---- */

struct drive_task {
    struct lumi_task task;
    struct lumi_service *service;
    uint32_t number, first_shot;
    struct lumi_rig rig;
    struct lumi_plan plan;
    uint8_t *states; /* our own: the engine may be through with the capture before the drive has stopped */
    bool reset;
    int code;
    struct lumi_error error;
};

struct notice_task {
    struct lumi_task task;
    struct lumi_service *service;
    struct lumi_rig_notice notice;
};

static void notice_done(struct lumi_task *task)
{
    struct notice_task *told = (struct notice_task *)task;

    lumi_engine_rig_notice(told->service->engine, lumi_service_now(), &told->notice);
}

/* In the drive's thread: what the board tells during the sweep goes the same way as ever. */
static void drive_notice(void *context, const struct lumi_rig_notice *notice)
{
    struct lumi_service *service = context;
    struct notice_task *told = lumi_service_task(sizeof *told, NULL, notice_done);

    told->service = service;
    told->notice = *notice;
    lumi_inbox_post(service->inbox, &told->task);
}

static bool drive_cancelled(void *context)
{
    return atomic_load(&((struct lumi_service *)context)->drive_cancel);
}

static bool drive_stopped(void *context)
{
    return atomic_load(&((struct lumi_service *)context)->drive_stop);
}

/* One that knows where it is need not look for it again; of one that cannot tell, a sweep from the beginning does. */
static int must_home(struct lumi_rig_drive *drive, uint32_t first_shot, bool *home, struct lumi_error *error)
{
    const struct lumi_drive_map *map = lumi_rig_drive_map(drive);
    struct lumi_rig_drive_status status;

    LUMI_TRY(lumi_rig_drive_status(drive, &status, error));
    *home = map->home.used && (map->homed.used ? !status.homed : first_shot == 0);
    return LUMI_OK;
}

static void drive_work(struct lumi_task *task)
{
    struct drive_task *asked = (struct drive_task *)task;
    struct lumi_service *service = asked->service;
    struct lumi_rig_drive *drive = NULL;
    bool home = false;

    asked->code = lumi_rig_drive_open(service->config->drive, &service->drive_map, &drive, &asked->error);
    if (asked->code == LUMI_OK)
        asked->code = must_home(drive, asked->first_shot, &home, &asked->error);
    if (asked->code == LUMI_OK) {
        struct lumi_rig_drive_sweep sweep = {.link = service->link,
                                             .drive = drive,
                                             .rig = &asked->rig,
                                             .plan = &asked->plan,
                                             .first_shot = asked->first_shot,
                                             .states = asked->states,
                                             .home = home,
                                             .reset = asked->reset && service->drive_map.reset.used,
                                             .context = service,
                                             .notice = drive_notice,
                                             .cancelled = drive_cancelled,
                                             .stopped = drive_stopped};
        asked->code = lumi_rig_drive_sweep(&sweep, &asked->error);
    }
    lumi_rig_drive_close(drive);
}

static void drive_done(struct lumi_task *task)
{
    struct drive_task *asked = (struct drive_task *)task;

    asked->service->drive_busy = false;
    g_free(asked->states);
    lumi_engine_rig_reply(asked->service->engine, lumi_service_now(), asked->number, asked->code, asked->error.text,
                          NULL);
    lumi_inbox_wake(asked->service->inbox);
}

static void drive_sweep(void *context, uint32_t number, const struct lumi_rig *rig, const struct lumi_plan *plan,
                        uint32_t first_shot, const uint8_t *states, bool reset)
{
    struct lumi_service *service = context;
    struct drive_task *asked = lumi_service_task(sizeof *asked, drive_work, drive_done);

    asked->service = service;
    asked->number = number;
    asked->rig = *rig;
    asked->plan = *plan;
    asked->first_shot = first_shot;
    asked->states = g_memdup2(states, (size_t)lumi_plan_shots(plan));
    asked->reset = reset;
    /* A stop that comes this moment is the board's already: it refuses to enable the drive. */
    atomic_store(&service->drive_cancel, false);
    atomic_store(&service->drive_stop, false);
    service->drive_busy = true;
    give(service->drives, service, &asked->task, &asked->code, &asked->error);
}

struct drive_question {
    struct lumi_task task;
    struct lumi_service *service;
    uint32_t number;
    int code;
    struct lumi_error error; /* also what it says where all is well */
};

static int ask_drive(struct lumi_rig_drive *drive, struct lumi_error *said)
{
    struct lumi_rig_drive_status status;
    size_t used;

    LUMI_TRY(lumi_rig_drive_status(drive, &status, said));
    if (status.fault)
        return lumi_fail(said, LUMI_ERR_BUSY, "%s: it has an alarm, fault %d", lumi_rig_drive_map(drive)->name,
                         status.fault_code);
    snprintf(said->text, sizeof said->text, "%s answers: %s, %s%s", lumi_rig_drive_map(drive)->name,
             status.ready ? "ready" : "not ready", status.enabled ? "enabled" : "not enabled",
             status.homed ? "" : ", not homed");
    used = strlen(said->text);
    if (status.position_known)
        snprintf(said->text + used, sizeof said->text - used, ", at %.3f turns",
                 fabs(status.turns) < 5e-4 ? 0 : status.turns); /* no "-0.000" */
    return LUMI_OK;
}

static void question_work(struct lumi_task *task)
{
    struct drive_question *asked = (struct drive_question *)task;
    struct lumi_service *service = asked->service;
    struct lumi_rig_drive *drive = NULL;

    asked->code = lumi_rig_drive_open(service->config->drive, &service->drive_map, &drive, &asked->error);
    if (asked->code == LUMI_OK)
        asked->code = ask_drive(drive, &asked->error);
    lumi_rig_drive_close(drive);
}

static void question_done(struct lumi_task *task)
{
    struct drive_question *asked = (struct drive_question *)task;

    lumi_engine_rig_reply(asked->service->engine, lumi_service_now(), asked->number, asked->code, asked->error.text,
                          NULL);
    lumi_inbox_wake(asked->service->inbox);
}

static void drive_check(void *context, uint32_t number)
{
    struct lumi_service *service = context;
    struct drive_question *asked = lumi_service_task(sizeof *asked, question_work, question_done);

    asked->service = service;
    asked->number = number;
    give(service->drives, service, &asked->task, &asked->code, &asked->error);
}

static void drive_cancel(void *context)
{
    atomic_store(&((struct lumi_service *)context)->drive_cancel, true);
}

void lumi_service_rig_ports(struct lumi_service *service, struct lumi_engine_ports *ports)
{
    ports->rig_request = request;
    ports->rig_read_profile = read_profile;
    ports->rig_stored = stored;
    ports->rig_emergency_stop = emergency_stop;
    ports->rig_to_host = to_host;
    if (service->config->drive[0]) {
        ports->drive_sweep = drive_sweep;
        ports->drive_cancel = drive_cancel;
        ports->drive_check = drive_check;
    }
}
