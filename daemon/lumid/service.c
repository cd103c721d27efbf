/* Life and loop. */
#include "daemon/lumid/service.h"

#include "daemon/lumid/service_priv.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <glib-unix.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <systemd/sd-daemon.h>

#define TICK_MS 250
#define DISK_SECONDS 2
#define END_NS (20 * INT64_C(1000000000)) /* until what moves stands and what was taken is stored */
#define REQUESTS 256
#define JUDGEMENTS 1024

/* ---- the loop ---- */

struct pump {
    GSource source;
    gpointer woken; /* the inbox's descriptor */
    struct lumi_service *service;
};

/* The engine is asked every time round: a request over HTTP may have given it something to wait for. */
static gboolean pump_prepare(GSource *source, int *timeout)
{
    const struct lumi_service *service = ((struct pump *)source)->service;
    int64_t next = lumi_engine_next(service->engine), now = lumi_service_now();

    *timeout = next == INT64_MAX ? -1 : next <= now ? 0 : (int)MIN((next - now + 999999) / 1000000, 3600000);
    return *timeout == 0;
}

static gboolean pump_check(GSource *source)
{
    const struct pump *pump = (struct pump *)source;

    return (g_source_query_unix_fd(source, pump->woken) & G_IO_IN) != 0 ||
           lumi_engine_next(pump->service->engine) <= lumi_service_now();
}

static bool ended(struct lumi_service *service)
{
    struct lumi_engine_status *status = service->status;

    if (lumi_service_now() >= service->ending_until_ns)
        return true;
    lumi_engine_status(service->engine, status);
    if (status->state == LUMI_ENGINE_SWEEPING && !service->resting) {
        service->resting = true;
        lumi_service_rest(service);
    }
    return status->state != LUMI_ENGINE_SWEEPING && status->state != LUMI_ENGINE_PAUSING &&
           status->state != LUMI_ENGINE_HOMING && status->state != LUMI_ENGINE_SEALING && status->store.jobs == 0;
}

static gboolean pump_dispatch(GSource *source, GSourceFunc callback, gpointer context)
{
    struct lumi_service *service = ((struct pump *)source)->service;

    (void)callback;
    (void)context;
    lumi_service_drain(service);
    if (service->ending && ended(service))
        g_main_loop_quit(service->loop);
    return G_SOURCE_CONTINUE;
}

static GSourceFuncs pump_functions = {.prepare = pump_prepare, .check = pump_check, .dispatch = pump_dispatch};

static gboolean tick(gpointer context)
{
    struct lumi_service *service = context;

    lumi_service_tick(service);
    lumi_inbox_wake(service->inbox);
    return G_SOURCE_CONTINUE;
}

static gboolean look_at_disk(gpointer context)
{
    struct lumi_service *service = context;

    lumi_engine_status(service->engine, service->status);
    lumi_service_measure(service, service->status->state == LUMI_ENGINE_PREFLIGHT);
    return G_SOURCE_CONTINUE;
}

static gboolean feed_watchdog(gpointer context)
{
    (void)context;
    sd_notify(0, "WATCHDOG=1");
    return G_SOURCE_CONTINUE;
}

/* The first time: what moves comes to rest, what was taken is stored, and the capture stays open: the next lumid goes
 * on with it. The second time: now. */
static gboolean end(gpointer context)
{
    struct lumi_service *service = context;

    if (service->ending || !service->engine) {
        g_main_loop_quit(service->loop);
        return G_SOURCE_CONTINUE;
    }
    lumi_service_log(6, "ending");
    sd_notify(0, "STOPPING=1\nSTATUS=ending");
    service->ending = true;
    service->ending_until_ns = lumi_service_now() + END_NS;
    lumi_inbox_wake(service->inbox);
    return G_SOURCE_CONTINUE;
}

/* ---- beginning ---- */

static int take_lock(struct lumi_service *service, struct lumi_error *error)
{
    char path[LUMI_CONFIG_PATH + 32];
    const char *folder = service->config->engine.folder;

    if (mkdir(folder, 0775) != 0 && errno != EEXIST)
        return lumi_fail_errno(error, folder, "making the captures' folder");
    snprintf(path, sizeof path, "%s/.lumid", folder);
    if (mkdir(path, 0755) != 0 && errno != EEXIST)
        return lumi_fail_errno(error, path, "making it");
    snprintf(path, sizeof path, "%s/.lumid/lock", folder);
    service->lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (service->lock < 0)
        return lumi_fail_errno(error, path, "opening it");
    if (flock(service->lock, LOCK_EX | LOCK_NB) != 0)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: another lumid has this folder", folder);
    return LUMI_OK;
}

static void processed(void *context, const struct lumi_process_status *status)
{
    static const char *const names[] = {"waits", "runs", "is done", "failed"};

    lumi_http_processing(((struct lumi_service *)context)->http, status);
    if (status->state == LUMI_PROCESS_RUNNING && status->progress > 0)
        return; /* once is enough here */
    lumi_service_log(status->state == LUMI_PROCESS_FAILED ? 3 : 6, "%s: processing %s%s%s", status->capture,
                     names[status->state], status->text[0] ? ": " : "", status->text);
}

static void ingested(void *context, const struct lumi_ingest_status *status)
{
    lumi_http_ingest(((struct lumi_service *)context)->http, status);
    if (status->state == LUMI_INGEST_TAKEN)
        lumi_service_log(6, "%s: taken in as %s", status->source, status->capture);
    else if (status->state == LUMI_INGEST_REFUSED)
        lumi_service_log(4, "%s: not taken in: %s", status->source, status->text);
}

static int start_handover(struct lumi_service *service, const char *ingest, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    struct lumi_handover_options options;
    struct lumi_ingest_options arrivals;
    char journal[LUMI_CONFIG_PATH + 32], arrived[LUMI_CONFIG_PATH + 32];

    snprintf(arrived, sizeof arrived, "%s/.lumid/arrived", config->engine.folder);
    snprintf(journal, sizeof journal, "%s/.lumid/journal", config->engine.folder);
    lumi_handover_options_init(&options);
    options.command = config->command;
    options.journal = journal;
    options.parallel = config->process_parallel;
    options.retries = config->process_retries;
    options.changed = processed;
    options.context = service;
    LUMI_TRY(lumi_handover_create(&options, &service->handover, error));
    if (!ingest[0])
        return LUMI_OK;
    lumi_ingest_options_init(&arrivals);
    arrivals.folder = ingest;
    arrivals.into = config->engine.folder;
    arrivals.journal = arrived;
    arrivals.settle = config->ingest_settle;
    arrivals.handover = service->handover;
    arrivals.changed = ingested;
    arrivals.context = service;
    return lumi_ingest_create(&arrivals, &service->ingest, error);
}

static int start_link(struct lumi_service *service, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    struct lumi_rig_link_options options;
    uint8_t *text = NULL;
    size_t size = 0;

    if (config->drive[0]) {
        LUMI_TRY(lumi_file_read(config->drive_map, 65536, &text, &size, error));
        int code = lumi_drive_map_parse((const char *)text, size, config->drive_map, &service->drive_map, error);
        lumi_free(text);
        LUMI_TRY(code);
    }
    lumi_rig_link_options_init(&options);
    options.holds = true;
    options.wake = lumi_inbox_wake;
    options.context = service->inbox;
    return lumi_rig_link_open(config->link, &options, &service->link, error);
}

static void wake(void *context)
{
    lumi_inbox_wake(((struct lumi_service *)context)->inbox);
}

static int start_gpio(struct lumi_service *service, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    const struct lumi_gpio_options options = {
        .estop = lumi_service_estop, .wake = wake, .gone = lumi_service_chip, .context = service};

    for (int i = 0; i < config->gpio_count; i++) {
        service->gpio_camera[i] = -1;
        for (int k = 0; k < config->engine.camera_count; k++)
            if (strcmp(config->gpio[i].camera, config->engine.cameras[k].name) == 0)
                service->gpio_camera[i] = k;
    }
    return config->gpio_count == 0 ? LUMI_OK
                                   : lumi_gpio_open(config->gpio, config->gpio_count, &options, &service->gpio, error);
}

static int start_cameras(struct lumi_service *service, struct lumi_error *error)
{
    struct lumi_camera_host_options options;

    lumi_camera_host_options_init(&options);
    options.wake = lumi_inbox_wake;
    options.context = service->inbox;
    for (int i = 0; i < service->config->engine.camera_count; i++) {
        const struct lumi_engine_camera *camera = &service->config->engine.cameras[i];
        int code = lumi_camera_host_start(camera->address, &options, &service->hosts[i], error);
        if (code != LUMI_OK) {
            return lumi_fail_prefix(error, "camera %s", camera->name);
        }
    }
    return LUMI_OK;
}

static int start_engine(struct lumi_service *service, struct lumi_error *error)
{
    struct lumi_engine_config *config = g_new(struct lumi_engine_config, 1);
    struct lumi_engine_ports ports;

    *config = service->config->engine;
    config->store.second_copy = service->config->second_copy[0] ? service->config->second_copy : NULL;
    config->store.wake = lumi_inbox_wake;
    config->store.context = service->inbox;
    config->utc_offset_ns = service->utc_offset_ns = lumi_service_utc_offset();
    lumi_service_ports(service, &ports);
    int code = lumi_engine_create(config, &ports, lumi_service_now(), &service->engine, error);
    g_free(config);
    return code;
}

/* With a large capture this takes seconds. */
/* What cannot be gone on with keeps nobody from taking the next capture, nor from looking at what is there. */
static void recover(struct lumi_service *service)
{
    struct lumi_error error;
    bool found = false;

    if (lumi_engine_recover(service->engine, lumi_service_now(), &found, &error) != LUMI_OK)
        lumi_service_log(3, "a capture that was interrupted stays as it is: %s", error.text);
    else if (found)
        lumi_service_log(5, "a capture that was interrupted goes on");
}

static int read_token(struct lumi_service *service, struct lumi_error *error)
{
    const char *path = service->config->token_file;
    uint8_t *text = NULL;
    size_t size = 0;

    if (!path[0])
        return LUMI_OK;
    LUMI_TRY(lumi_file_read(path, 4096, &text, &size, error));
    service->token = g_strndup((const char *)text, strcspn((const char *)text, "\r\n"));
    lumi_free(text);
    g_strstrip(service->token);
    if (strlen(service->token) < 16)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its first line, the token, has %zu characters; 16 are the least",
                         path, strlen(service->token));
    return LUMI_OK;
}

static int64_t http_now(void *context)
{
    (void)context;
    return lumi_service_now();
}

static int64_t http_unix_us(void *context)
{
    (void)context;
    return (lumi_service_now() + lumi_service_utc_offset()) / 1000;
}

static bool http_emergency_stop(void *context)
{
    struct lumi_service *service = context;
    struct lumi_rig_link_snapshot snapshot;
    bool sent = lumi_service_stop_at_once(service);

    lumi_rig_link_snapshot(service->link, &snapshot); /* an open port with nobody behind it is no board */
    return sent && snapshot.state == LUMI_RIG_LINK_OPEN;
}

static int http_devices(void *context, struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    (void)context;
    return lumi_camera_list(cameras, max, error);
}

static int start_http(struct lumi_service *service, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    struct lumi_http_options options;

    lumi_http_options_init(&options);
    LUMI_TRY(read_token(service, error));
    options.listen = config->listen;
    options.token = service->token;
    options.certificate = config->certificate[0] ? config->certificate : NULL;
    options.key = config->key[0] ? config->key : NULL;
    options.body_max = config->body_max;
    options.access = config->access[0] ? config->access : NULL;
    options.secure = config->secure;
    options.session_idle_ns = (int64_t)(config->session_idle * 1e9);
    options.session_most_ns = (int64_t)(config->session_most * 1e9);
    options.unix_us = http_unix_us;
    options.folder = config->engine.folder;
    options.second_copy = config->second_copy[0] ? config->second_copy : NULL;
    options.preview = config->preview;
    options.engine = service->engine;
    options.handover = service->handover;
    options.processes = config->command[0] != '\0';
    options.ingest = service->ingest;
    options.now_ns = http_now;
    options.emergency_stop = http_emergency_stop;
    options.devices = http_devices;
    options.pictures = service->pictures;
    options.context = service;
    return lumi_http_start(&options, &service->http, error);
}

static void start_loop(struct lumi_service *service)
{
    struct pump *pump = (struct pump *)g_source_new(&pump_functions, sizeof(struct pump));

    pump->service = service;
    pump->woken = g_source_add_unix_fd(&pump->source, lumi_inbox_fd(service->inbox), G_IO_IN);
    service->pump = &pump->source;
    g_source_attach(service->pump, NULL);
    g_timeout_add(TICK_MS, tick, service);
    g_timeout_add_seconds(DISK_SECONDS, look_at_disk, service);
    lumi_service_measure(service, true);
}

static int start_rig(struct lumi_service *service, struct lumi_error *error)
{
    const struct lumi_config *config = service->config;
    int processors = (int)g_get_num_processors();
    int judges = config->judge_workers ? config->judge_workers : MAX(1, processors - 1);

    LUMI_TRY(lumi_pool_create(service->inbox, 1, REQUESTS, &service->requests, error));
    LUMI_TRY(lumi_pool_create(service->inbox, 1, 1, &service->drives, error));
    LUMI_TRY(lumi_pool_create(service->inbox, judges, JUDGEMENTS, &service->judges, error));
    LUMI_TRY(lumi_pool_create(service->inbox, 1, 4, &service->chores, error));
    LUMI_TRY(lumi_service_pictures_start(service, error));
    LUMI_TRY(start_link(service, error));
    LUMI_TRY(start_gpio(service, error));
    LUMI_TRY(start_cameras(service, error));
    LUMI_TRY(start_engine(service, error));
    LUMI_TRY(start_http(service, error)); /* an emergency stop is heard from here on */
    recover(service);
    start_loop(service);
    return LUMI_OK;
}

/* ---- the end ---- */

/* What works for the engine ends before it, what it asks after it; the emergency stop is heard as long as there is a
 * link. */
static void finish(struct lumi_service *service)
{
    lumi_http_stop(service->http);
    service->http = NULL;
    if (service->pump) {
        g_source_destroy(service->pump);
        g_source_unref(service->pump);
    }
    atomic_store(&service->drive_cancel, true);
    lumi_pool_destroy(service->drives);
    lumi_pool_destroy(service->judges);
    if (service->engine)
        lumi_inbox_run(service->inbox);
    lumi_pictures_destroy(service->pictures); /* before the cameras: it may hold frames */
    service->pictures = NULL;
    lumi_engine_destroy(service->engine);
    service->engine = NULL;
    lumi_pool_destroy(service->requests);
    lumi_pool_destroy(service->chores);
    for (int i = 0; i < LUMI_RIG_CAMERAS; i++)
        lumi_camera_host_stop(service->hosts[i]);
    lumi_gpio_close(service->gpio);
    lumi_rig_link_close(service->link);
    lumi_ingest_destroy(service->ingest);
    lumi_handover_destroy(service->handover);
    lumi_inbox_destroy(service->inbox);
    if (service->loop)
        g_main_loop_unref(service->loop);
    if (service->lock >= 0)
        close(service->lock);
    g_free(service->token);
    g_free(service->status);
}

static void say_ready(struct lumi_service *service, const char *ingest)
{
    uint64_t watchdog_us = 0;

    if (sd_watchdog_enabled(0, &watchdog_us) > 0)
        g_timeout_add((guint)MAX(watchdog_us / 2000, 1), feed_watchdog, NULL);
    if (ingest)
        lumi_service_log(6, "lumid %s: taking in what arrives in %s", LUMI_VERSION, ingest);
    else
        lumi_service_log(6, "lumid %s: ready, port %d, %d cameras, captures in %s", LUMI_VERSION,
                         lumi_http_port(service->http), service->config->engine.camera_count,
                         service->config->engine.folder);
    if (service->engine)
        lumi_engine_status(service->engine, service->status);
    sd_notifyf(0, "READY=1\nSTATUS=%s", service->engine ? lumi_engine_state_name(service->status->state) : "taking in");
}

int lumi_service_run(const struct lumi_service_options *options, struct lumi_error *error)
{
    struct lumi_service *service = g_new0(struct lumi_service, 1);
    const struct lumi_config *config = options->config;

    service->config = config;
    service->lock = -1;
    service->status = g_new0(struct lumi_engine_status, 1);
    signal(SIGPIPE, SIG_IGN);
    lumi_service_log_libraries();
    int code = take_lock(service, error);
    if (code == LUMI_OK)
        code = lumi_inbox_create(&service->inbox, error);
    service->loop = g_main_loop_new(NULL, FALSE);
    guint signals[] = {g_unix_signal_add(SIGTERM, end, service), g_unix_signal_add(SIGINT, end, service)};
    if (code == LUMI_OK)
        code = start_handover(service, options->ingest ? options->ingest : config->ingest_folder, error);
    if (code == LUMI_OK && !options->ingest)
        code = start_rig(service, error);
    if (code == LUMI_OK) {
        say_ready(service, options->ingest);
        g_main_loop_run(service->loop);
        lumi_service_log(6, "ended");
    }
    for (int i = 0; i < 2; i++)
        g_source_remove(signals[i]);
    finish(service);
    g_free(service);
    return code;
}
