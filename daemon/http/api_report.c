/* What the engine knows, as the API says it. */
#include "daemon/http/api_report.h"

#include <math.h>

static void put_disk(JsonBuilder *builder, const struct lumi_engine_status *status)
{
    const double rate = status->store.bytes_per_second;
    const double left = status->disk_free_bytes >= 0 ? (double)status->disk_free_bytes : NAN;

    lumi_api_put_double(builder, "bytes_per_second", rate);
    lumi_api_put_double(builder, "disk_free_bytes", left);
    lumi_api_put_double(builder, "disk_seconds_left", rate > 0 ? round(left / rate) : NAN);
}

/* A hundredth of a degree is more than anybody sees, and what stands still says the same again. */
static double rounded(double value)
{
    return round(value * 1e4) / 1e4;
}

static void put_arm(JsonBuilder *builder, const struct lumi_engine_arm *arm)
{
    if (!arm->known) {
        lumi_api_put_double(builder, "arm", NAN);
        return;
    }
    lumi_api_put_object(builder, "arm");
    lumi_api_put_double(builder, "turn", arm->turn_known ? rounded(arm->turn) : NAN);
    lumi_api_put_double(builder, "yaw", rounded(arm->yaw));
    lumi_api_put_double(builder, "pitch", arm->turn_known ? rounded(arm->pitch) : NAN);
    lumi_api_put_array(builder, "cameras");
    for (int c = 0; c < arm->camera_count && arm->turn_known; c++) {
        json_builder_begin_array(builder);
        for (int i = 0; i < 3; i++)
            json_builder_add_double_value(builder, rounded(arm->cameras[c][i]));
        json_builder_end_array(builder);
    }
    json_builder_end_array(builder);
    json_builder_end_object(builder);
}

void lumi_api_capture(JsonBuilder *builder, const struct lumi_engine_status *status)
{
    const struct {
        const char *name;
        int count;
    } counts[] = {
        {"round", status->round},         {"shots", status->shots},       {"fired", status->fired},
        {"lost", status->lost},           {"frames", status->frames},     {"planned", status->planned},
        {"triggered", status->triggered}, {"exposed", status->exposed},   {"received", status->received},
        {"stored", status->stored},       {"accepted", status->accepted}, {"rejected", status->rejected},
        {"missing", status->missing},
    };

    lumi_api_put_text(builder, "state", lumi_engine_state_name(status->state));
    lumi_api_put_text(builder, "text", status->text);
    lumi_api_put_text(builder, "path", status->capture);
    lumi_api_put_text(builder, "plan", status->plan_name);
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        lumi_api_put_int(builder, counts[i].name, counts[i].count);
    lumi_api_put_int(builder, "bytes", status->bytes);
    lumi_api_put_double(builder, "seconds_left", status->seconds_left);
    lumi_api_put_bool(builder, "complete", status->complete);
    put_disk(builder, status);
    put_arm(builder, &status->arm);
}

void lumi_api_check(JsonBuilder *builder, const struct lumi_engine_check *check)
{
    lumi_api_put_text(builder, "name", check->name);
    lumi_api_put_text(builder, "verdict", lumi_verdict_name(check->verdict));
    lumi_api_put_bool(builder, "overridden", check->overridden);
    lumi_api_put_text(builder, "reason", check->reason);
}

void lumi_api_checks(JsonBuilder *builder, const struct lumi_engine_status *status)
{
    lumi_api_put_array(builder, "checks");
    for (int i = 0; i < status->check_count; i++) {
        json_builder_begin_object(builder);
        lumi_api_check(builder, &status->checks[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
}

void lumi_api_identity(JsonBuilder *builder, const struct lumi_camera_identity *identity)
{
    lumi_api_put_text(builder, "backend", lumi_camera_backend_name(identity->backend));
    lumi_api_put_text(builder, "serial", identity->serial);
    lumi_api_put_text(builder, "vendor", identity->vendor);
    lumi_api_put_text(builder, "model", identity->model);
    lumi_api_put_text(builder, "firmware", identity->firmware);
    lumi_api_put_text(builder, "address", identity->address);
    lumi_api_put_bool(builder, "hardware_trigger", identity->hardware_trigger);
    lumi_api_put_bool(builder, "software_trigger", identity->software_trigger);
    lumi_api_put_bool(builder, "exposure_control", identity->exposure_control);
    lumi_api_put_bool(builder, "device_clock", identity->device_clock);
    lumi_api_put_bool(builder, "records_itself", identity->records_itself);
}

/* The engine's 0 is "not known". */
static double known(double value)
{
    return value > 0 ? value : NAN;
}

static void put_size(JsonBuilder *builder, const char *name, int pixels)
{
    if (pixels > 0)
        lumi_api_put_int(builder, name, pixels);
    else
        lumi_api_put_double(builder, name, NAN);
}

static void put_camera(JsonBuilder *builder, const struct lumi_engine_camera_status *camera)
{
    lumi_api_put_text(builder, "name", camera->name);
    lumi_api_put_bool(builder, "there", camera->there);
    lumi_api_put_bool(builder, "configured", camera->configured);
    lumi_api_put_bool(builder, "armed", camera->armed);
    lumi_api_put_object(builder, "identity");
    lumi_api_identity(builder, &camera->identity);
    json_builder_end_object(builder);
    put_size(builder, "width", camera->status.format.width);
    put_size(builder, "height", camera->status.format.height);
    lumi_api_put_double(builder, "exposure_s", known(camera->status.exposure_s));
    lumi_api_put_double(builder, "gain", known(camera->status.gain));
    lumi_api_put_double(builder, "temperature", camera->status.temperature);
    lumi_api_put_double(builder, "battery", camera->status.battery);
    const int64_t card = camera->status.card_free_bytes;
    lumi_api_put_double(builder, "card_free_bytes", card < 0 ? NAN : (double)card);
    lumi_api_put_int(builder, "frames", (int64_t)camera->status.frames);
    lumi_api_put_int(builder, "frames_dropped", (int64_t)camera->status.dropped);
    lumi_api_put_int(builder, "frames_damaged", (int64_t)camera->status.damaged);
    lumi_api_put_int(builder, "packets_resent", (int64_t)camera->status.packets_resent);
    lumi_api_put_int(builder, "packets_missing", (int64_t)camera->status.packets_missing);
    lumi_api_put_int(builder, "matched", (int64_t)camera->matched);
    lumi_api_put_int(builder, "dropped", (int64_t)camera->dropped);
    lumi_api_put_int(builder, "doubled", (int64_t)camera->doubled);
    lumi_api_put_int(builder, "late", (int64_t)camera->late);
    lumi_api_put_int(builder, "out_of_order", (int64_t)camera->out_of_order);
    lumi_api_put_int(builder, "surplus", (int64_t)camera->surplus);
    lumi_api_put_bool(builder, "clock_fitted", camera->clock_fitted);
    const bool fitted = camera->clock_fitted;
    lumi_api_put_double(builder, "clock_offset_s", fitted ? camera->clock_offset_s : NAN);
    lumi_api_put_double(builder, "clock_drift_ppm", fitted ? camera->clock_drift_ppm : NAN);
    lumi_api_put_double(builder, "clock_residual_s", fitted ? camera->clock_residual_s : NAN);
    lumi_api_put_double(builder, "clock_residual_worst_s", fitted ? camera->clock_residual_worst_s : NAN);
}

static const char *link_name(enum lumi_rig_link_state state)
{
    static const char *const names[] = {"closed", "silent", "foreign", "version", "open"};

    return (unsigned)state < 5 ? names[state] : "unknown";
}

static void put_rig(JsonBuilder *builder, const struct lumi_rig_link_snapshot *rig)
{
    const char *state = rig->status_known ? lumi_wire_state_name(rig->status.state) : NULL;

    lumi_api_put_text(builder, "link", link_name(rig->state));
    lumi_api_put_text(builder, "address", rig->name);
    lumi_api_put_text(builder, "text", rig->text);
    lumi_api_put_text(builder, "board", rig->welcome.board);
    lumi_api_put_text(builder, "firmware", rig->welcome.firmware);
    lumi_api_put_int(builder, "protocol", rig->welcome.version);
    lumi_api_put_text(builder, "state", state ? state : "unknown");
    lumi_api_put_array(builder, "faults");
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        if (rig->status_known && rig->status.faults >> i & 1)
            json_builder_add_string_value(builder, lumi_rig_fault_names[i]);
    json_builder_end_array(builder);
    lumi_api_put_bool(builder, "position_known", rig->status.position_known);
    lumi_api_put_int(builder, "step", rig->status.step);
    lumi_api_put_double(builder, "pitch", rig->status.pitch);
    lumi_api_put_double(builder, "speed", rig->status.speed);
    lumi_api_put_bool(builder, "motor", rig->status.enabled);
    lumi_api_put_double(builder, "supply_v", rig->status.supply_mv * 1e-3);
    lumi_api_put_bool(builder, "stop_pending", rig->stop_pending);
    lumi_api_put_bool(builder, "clock_matched", rig->clock_matched);
    lumi_api_put_double(builder, "clock_drift_ppm", rig->clock_drift_ppm);
    lumi_api_put_double(builder, "clock_residual_s", rig->clock_residual_ns * 1e-9);
    lumi_api_put_double(builder, "round_trip_s", rig->round_trip_ns * 1e-9);
    lumi_api_put_int(builder, "reconnections", rig->reconnections);
    lumi_api_put_int(builder, "restarts", rig->restarts);
    lumi_api_put_int(builder, "requests_lost", rig->requests_lost);
}

static void put_store(JsonBuilder *builder, const struct lumi_engine_status *status)
{
    const struct lumi_store_figures *store = &status->store;

    lumi_api_put_int(builder, "room_bytes", (int64_t)store->room);
    lumi_api_put_int(builder, "waiting_bytes", (int64_t)store->waiting);
    lumi_api_put_int(builder, "waiting_jobs", store->jobs);
    lumi_api_put_int(builder, "stored_bytes", store->stored_bytes);
    lumi_api_put_double(builder, "bytes_per_second", store->bytes_per_second);
    lumi_api_put_double(builder, "slowest_seconds", store->slowest_seconds);
    lumi_api_put_int(builder, "copy_behind_bytes", store->copy_behind_bytes);
    lumi_api_put_bool(builder, "copy_failed", store->copy_code != 0);
    lumi_api_put_text(builder, "copy_text", store->copy_text);
    lumi_api_put_int(builder, "disk_free_bytes", status->disk_free_bytes);
    lumi_api_put_double(builder, "disk_bytes_per_second", status->disk_bytes_per_second);
}

void lumi_api_status(JsonBuilder *builder, const struct lumi_engine_status *status)
{
    lumi_api_put_text(builder, "version", LUMI_VERSION);
    lumi_api_put_bool(builder, "estop", status->estop);
    lumi_api_put_object(builder, "capture");
    lumi_api_capture(builder, status);
    json_builder_end_object(builder);
    lumi_api_checks(builder, status);
    lumi_api_put_object(builder, "rig");
    put_rig(builder, &status->rig);
    json_builder_end_object(builder);
    lumi_api_put_array(builder, "cameras");
    for (int i = 0; i < status->camera_count; i++) {
        json_builder_begin_object(builder);
        put_camera(builder, &status->cameras[i]);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_api_put_object(builder, "store");
    put_store(builder, status);
    json_builder_end_object(builder);
}

void lumi_api_missing(JsonBuilder *builder, const struct lumi_engine_missing *missing)
{
    lumi_api_put_text(builder, "frame", missing->frame);
    lumi_api_put_text(builder, "camera", missing->camera);
    lumi_api_put_int(builder, "shot", missing->shot);
    lumi_api_put_text(builder, "state", lumi_frame_state_name(missing->state));
    lumi_api_put_text(builder, "class", lumi_judge_fault_name(missing->fault));
    lumi_api_put_text(builder, "reason", missing->reason);
}

void lumi_api_processing(JsonBuilder *builder, const struct lumi_process_status *status)
{
    static const char *const names[] = {"waiting", "running", "done", "failed"};

    lumi_api_put_text(builder, "capture", status->capture);
    lumi_api_put_text(builder, "state", (unsigned)status->state < 4 ? names[status->state] : "unknown");
    lumi_api_put_double(builder, "progress", status->progress >= 0 ? status->progress : NAN);
    lumi_api_put_text(builder, "stage", status->stage);
    lumi_api_put_int(builder, "exit_status", status->exit_status);
    lumi_api_put_text(builder, "text", status->text);
}

void lumi_api_ingest(JsonBuilder *builder, const struct lumi_ingest_status *status)
{
    static const char *const names[] = {"seen", "copying", "verifying", "taken", "refused"};

    lumi_api_put_text(builder, "source", status->source);
    lumi_api_put_text(builder, "capture", status->capture);
    lumi_api_put_text(builder, "state", (unsigned)status->state < 5 ? names[status->state] : "unknown");
    lumi_api_put_int(builder, "bytes", status->bytes);
    lumi_api_put_int(builder, "total", status->total);
    lumi_api_put_text(builder, "text", status->text);
}

void lumi_api_board(JsonBuilder *builder, const struct lumi_rig_usb_board *board)
{
    lumi_api_put_text(builder, "serial", board->serial);
    lumi_api_put_text(builder, "place", board->place);
    lumi_api_put_text(builder, "text", board->text);
}
