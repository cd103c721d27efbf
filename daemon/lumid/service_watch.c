/* What happens, on its way to the engine: notices of link and cameras, edges, the disk, the clock. */
#include "daemon/lumid/service_priv.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#define AT_ONCE 256                            /* notices of one kind before the loop sees to others */
#define MEASURED_BYTES ((size_t)64 << 20)      /* written to see how fast the disk is */
#define MEASURED_NS (60 * INT64_C(1000000000)) /* so long that counts */
#define CLOCK_STEP_NS 1000000                  /* a wall clock that goes so far astray was set */

int64_t lumi_service_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

int64_t lumi_service_utc_offset(void)
{
    struct timespec wall;

    clock_gettime(CLOCK_REALTIME, &wall);
    return (int64_t)wall.tv_sec * 1000000000 + wall.tv_nsec - lumi_service_now();
}

void *lumi_service_task(size_t size, void (*work)(struct lumi_task *), void (*done)(struct lumi_task *))
{
    struct lumi_task *task = g_malloc0(size);

    task->work = work;
    task->done = done;
    return task;
}

/* ---- the emergency stop ---- */

struct estop_task {
    struct lumi_task task;
    struct lumi_service *service;
    bool pressed;
};

static void estop_done(struct lumi_task *task)
{
    struct estop_task *told = (struct estop_task *)task;

    lumi_service_log(4, told->pressed ? "emergency stop" : "the emergency stop is released");
    if (told->service->engine)
        lumi_engine_estop(told->service->engine, lumi_service_now(), told->pressed);
}

bool lumi_service_stop_at_once(struct lumi_service *service)
{
    bool sent = lumi_rig_link_emergency_stop(service->link);

    atomic_store(&service->drive_stop, true);
    return sent;
}

void lumi_service_estop(void *context, bool pressed, int64_t at_ns)
{
    struct lumi_service *service = context;

    (void)at_ns;
    if (pressed)
        lumi_service_stop_at_once(service);
    struct estop_task *told = lumi_service_task(sizeof *told, NULL, estop_done);
    told->service = service;
    told->pressed = pressed;
    lumi_inbox_post(service->inbox, &told->task);
}

struct chip_task {
    struct lumi_task task;
    struct lumi_service *service;
    int line;
    bool gone;
};

static void chip_done(struct lumi_task *task)
{
    struct chip_task *told = (struct chip_task *)task;
    const struct lumi_gpio_line *line = &told->service->config->gpio[told->line];
    char text[160];

    lumi_gpio_line_text(line, text, sizeof text);
    if (!told->gone)
        lumi_service_log(6, "%s: its chip is back", text);
    else if (line->role == LUMI_GPIO_ESTOP)
        lumi_service_log(3, "%s: its chip is gone; that counts as pressed", text);
    else
        lumi_service_log(4, "%s: its chip is gone", text);
}

void lumi_service_chip(void *context, int line, bool gone)
{
    struct lumi_service *service = context;
    struct chip_task *told = lumi_service_task(sizeof *told, NULL, chip_done);

    told->service = service;
    told->line = line;
    told->gone = gone;
    lumi_inbox_post(service->inbox, &told->task);
}

/* ---- notices ---- */

/* Which rig it is, is asked when nobody wants to know yet: where the arm is, what plans come to. */
static void greet(struct lumi_service *service, const struct lumi_rig_notice *notice)
{
    lumi_service_log(6, "the board is there%s", notice->restarted ? "; it has started again" : "");
    if (notice->restarted || !service->profile_asked)
        lumi_service_read_profile(service);
}

static bool drain_link(struct lumi_service *service)
{
    struct lumi_rig_link_snapshot snapshot;
    struct lumi_rig_notice notice;
    int count = 0;

    if (service->drive_busy)
        return false;
    while (count < AT_ONCE && lumi_rig_link_notice(service->link, 0, &notice)) {
        if (notice.kind == LUMI_RIG_NOTICE_CONNECTED)
            greet(service, &notice);
        else if (notice.kind == LUMI_RIG_NOTICE_DISCONNECTED)
            lumi_service_log(4, "the board is gone: %s", notice.text);
        lumi_engine_rig_notice(service->engine, lumi_service_now(), &notice);
        count++;
    }
    if (count > 0) {
        lumi_rig_link_snapshot(service->link, &snapshot);
        lumi_engine_rig_status(service->engine, lumi_service_now(), &snapshot);
    }
    return count == AT_ONCE;
}

static bool drain_camera(struct lumi_service *service, int camera)
{
    struct lumi_camera_notice notice;
    int count = 0;

    while (count < AT_ONCE && lumi_camera_host_notice(service->hosts[camera], &notice)) {
        const char *name = service->config->engine.cameras[camera].name;
        if (notice.kind == LUMI_CAMERA_CAME)
            lumi_service_log(6, "camera %s is there: %s %s, serial %s, %s", name, notice.identity.vendor,
                             notice.identity.model, notice.identity.serial, notice.identity.address);
        else if (notice.kind == LUMI_CAMERA_GONE)
            lumi_service_log(4, "camera %s is not there: %s", name, notice.text);
        lumi_engine_camera_notice(service->engine, lumi_service_now(), camera, &notice);
        count++;
    }
    return count == AT_ONCE;
}

static bool drain_gpio(struct lumi_service *service)
{
    const struct lumi_config *config = service->config;
    struct lumi_gpio_edge edge;
    int count = 0;

    while (service->gpio && count < AT_ONCE && lumi_gpio_edge(service->gpio, &edge)) {
        if (edge.active && config->gpio[edge.line].role == LUMI_GPIO_SYNC)
            lumi_engine_sync_edge(service->engine, lumi_service_now(), service->gpio_camera[edge.line], edge.at_ns,
                                  edge.lost);
        count++;
    }
    return count == AT_ONCE;
}

void lumi_service_drain(struct lumi_service *service)
{
    lumi_inbox_run(service->inbox);
    bool more = drain_link(service);
    more = drain_gpio(service) || more;
    for (int i = 0; i < service->config->engine.camera_count; i++)
        more = drain_camera(service, i) || more;
    lumi_engine_run(service->engine, lumi_service_now());
    if (more)
        lumi_inbox_wake(service->inbox);
}

/* ---- the disk ---- */

struct disk_task {
    struct lumi_task task;
    struct lumi_service *service;
    bool speed;
    int code;
    int64_t free_bytes;
    double bytes_per_second;
    struct lumi_error error;
};

static void disk_work(struct lumi_task *task)
{
    struct disk_task *asked = (struct disk_task *)task;
    const char *folder = asked->service->config->engine.folder;

    asked->code = lumi_store_disk(folder, &asked->free_bytes, &asked->error);
    if (asked->code == LUMI_OK && asked->speed)
        asked->code = lumi_store_measure(folder, MEASURED_BYTES, &asked->bytes_per_second, &asked->error);
}

static void disk_done(struct lumi_task *task)
{
    struct disk_task *asked = (struct disk_task *)task;
    struct lumi_service *service = asked->service;

    service->disk_asked = false;
    if (asked->code != LUMI_OK)
        lumi_service_log(4, "%s", asked->error.text);
    if (asked->speed)
        service->disk_bytes_per_second = asked->code == LUMI_OK ? asked->bytes_per_second : 0;
    lumi_engine_disk(service->engine, lumi_service_now(), asked->free_bytes, service->disk_bytes_per_second);
}

void lumi_service_measure(struct lumi_service *service, bool speed)
{
    int64_t now = lumi_service_now();

    if (service->disk_asked)
        return;
    struct disk_task *asked = lumi_service_task(sizeof *asked, disk_work, disk_done);
    asked->service = service;
    asked->speed = speed && (service->measured_ns == 0 || now - service->measured_ns > MEASURED_NS);
    if (asked->speed)
        service->measured_ns = now;
    if (lumi_pool_give(service->chores, &asked->task))
        service->disk_asked = true;
    else
        free(asked);
}

/* ---- several times a second ---- */

void lumi_service_tick(struct lumi_service *service)
{
    struct lumi_rig_link_snapshot snapshot;
    int64_t now = lumi_service_now(), offset = lumi_service_utc_offset();

    lumi_rig_link_snapshot(service->link, &snapshot);
    lumi_engine_rig_status(service->engine, now, &snapshot);
    lumi_service_pictures_tick(service, now);
    if (llabs(offset - service->utc_offset_ns) > CLOCK_STEP_NS) {
        service->utc_offset_ns = offset;
        lumi_engine_clock(service->engine, offset);
    }
}
