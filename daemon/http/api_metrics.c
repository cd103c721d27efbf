/* The engine's numbers for Prometheus (text exposition format 0.0.4). */
#include "daemon/http/api_report.h"

#include <glib.h>
#include <inttypes.h>

static void put_head(GString *out, const char *name, const char *type, const char *help)
{
    g_string_append_printf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void put_number(GString *out, double value)
{
    char text[G_ASCII_DTOSTR_BUF_SIZE];

    g_string_append_printf(out, " %s\n", g_ascii_dtostr(text, sizeof text, value));
}

static void put_one(GString *out, const char *name, const char *type, const char *help, double value)
{
    if (value != value) /* unknown: no sample at all */
        return;
    put_head(out, name, type, help);
    g_string_append(out, name);
    put_number(out, value);
}

/* A label's value: backslash, quote and newline are escaped. */
static void put_label(GString *out, const char *name, const char *label, const char *value)
{
    g_autofree char *valid = g_utf8_make_valid(value, -1);

    g_string_append_printf(out, "%s{%s=\"", name, label);
    for (const char *c = valid; *c; c++) {
        if (*c == '\\' || *c == '"')
            g_string_append_c(out, '\\');
        if (*c == '\n')
            g_string_append(out, "\\n");
        else
            g_string_append_c(out, *c);
    }
    g_string_append(out, "\"}");
}

static void put_capture(GString *out, const struct lumi_engine_status *status)
{
    const struct {
        const char *state;
        int count;
    } frames[] = {
        {"planned", status->planned},   {"triggered", status->triggered}, {"exposed", status->exposed},
        {"received", status->received}, {"stored", status->stored},       {"accepted", status->accepted},
        {"rejected", status->rejected}, {"missing", status->missing},
    };

    put_head(out, "lumid_state", "gauge", "1 for the state the capture engine is in");
    for (int i = 0; i < LUMI_ENGINE_STATES; i++) {
        put_label(out, "lumid_state", "state", lumi_engine_state_name((enum lumi_engine_state)i));
        put_number(out, (int)status->state == i);
    }
    put_one(out, "lumid_shots", "gauge", "shots of the plan", status->shots);
    put_one(out, "lumid_shots_fired", "gauge", "shots fired", status->fired);
    put_one(out, "lumid_shots_lost", "gauge", "shots lost", status->lost);
    put_head(out, "lumid_frames", "gauge", "frames of the capture by the state each is in");
    for (size_t i = 0; i < sizeof frames / sizeof frames[0]; i++) {
        put_label(out, "lumid_frames", "state", frames[i].state);
        put_number(out, frames[i].count);
    }
    put_one(out, "lumid_retake_round", "gauge", "0 in the sweep itself", status->round);
    put_one(out, "lumid_capture_complete", "gauge", "1 when every frame is accepted", status->complete);
    put_one(out, "lumid_capture_bytes", "gauge", "bytes of the capture's frames", (double)status->bytes);
    put_one(out, "lumid_seconds_left", "gauge", "of the sweep, as planned", status->seconds_left);
}

static void put_store(GString *out, const struct lumi_engine_status *status)
{
    const struct lumi_store_figures *store = &status->store;

    put_one(out, "lumid_store_waiting_bytes", "gauge", "bytes that wait to be written", (double)store->waiting);
    put_one(out, "lumid_store_room_bytes", "gauge", "bytes that may still be given", (double)store->room);
    put_one(out, "lumid_store_stored_bytes", "gauge", "bytes of this capture on the disk", (double)store->stored_bytes);
    put_one(out, "lumid_store_bytes_per_second", "gauge", "bytes a second, of the last seconds",
            store->bytes_per_second);
    put_one(out, "lumid_store_slowest_seconds", "gauge", "the slowest write of the last minute",
            store->slowest_seconds);
    put_one(out, "lumid_store_copy_behind_bytes", "gauge", "what the second copy lags behind",
            (double)store->copy_behind_bytes);
    put_one(out, "lumid_store_copy_failed", "gauge", "1: the second copy is given up", store->copy_code != 0);
    put_one(out, "lumid_disk_free_bytes", "gauge", "free bytes where captures are made",
            (double)status->disk_free_bytes);
}

static void put_rig(GString *out, const struct lumi_engine_status *status)
{
    const struct lumi_rig_link_snapshot *rig = &status->rig;

    put_one(out, "lumid_estop", "gauge", "1 while an emergency stop is pressed", status->estop);
    put_one(out, "lumid_rig_link_open", "gauge", "1 with a session to the board", rig->state == LUMI_RIG_LINK_OPEN);
    put_one(out, "lumid_rig_reconnections_total", "counter", "sessions after the first", rig->reconnections);
    put_one(out, "lumid_rig_restarts_total", "counter", "restarts of the board", rig->restarts);
    put_one(out, "lumid_rig_requests_lost_total", "counter", "requests nobody can know about", rig->requests_lost);
    if (rig->clock_matched)
        put_one(out, "lumid_rig_clock_residual_seconds", "gauge", "of the fit between board and host",
                rig->clock_residual_ns * 1e-9);
    put_head(out, "lumid_rig_fault", "gauge", "1 for each fault that stands");
    for (int i = 0; i < LUMI_RIG_FAULTS; i++) {
        put_label(out, "lumid_rig_fault", "fault", lumi_rig_fault_names[i]);
        put_number(out, rig->status_known && rig->status.faults >> i & 1);
    }
}

static double camera_value(const struct lumi_engine_camera_status *camera, int what)
{
    switch (what) {
    case 0:
        return camera->there;
    case 1:
        return (double)camera->matched;
    case 2:
        return (double)camera->dropped;
    case 3:
        return (double)camera->status.packets_resent;
    case 4:
        return (double)camera->status.packets_missing;
    case 5:
        return camera->clock_residual_s;
    default:
        return camera->status.temperature;
    }
}

static void put_cameras(GString *out, const struct lumi_engine_status *status)
{
    static const char *const what[][3] = {
        {"lumid_camera_there", "gauge", "1 while the camera is connected"},
        {"lumid_camera_frames_matched", "gauge", "frames of this capture that belong to a shot"},
        {"lumid_camera_frames_dropped", "gauge", "frames of this capture that never came"},
        {"lumid_camera_packets_resent", "gauge", "packets asked for again since it was armed"},
        {"lumid_camera_packets_missing", "gauge", "packets that never came since it was armed"},
        {"lumid_camera_clock_residual_seconds", "gauge", "of the fit between the camera's clock and the host's"},
        {"lumid_camera_temperature_celsius", "gauge", "where the camera tells it"},
    };

    for (size_t i = 0; i < sizeof what / sizeof what[0]; i++) {
        put_head(out, what[i][0], what[i][1], what[i][2]);
        for (int k = 0; k < status->camera_count; k++) {
            double value = camera_value(&status->cameras[k], (int)i);
            if (value != value)
                continue;
            put_label(out, what[i][0], "camera", status->cameras[k].name);
            put_number(out, value);
        }
    }
}

char *lumi_api_metrics(const struct lumi_engine_status *status)
{
    GString *out = g_string_new(NULL);

    put_head(out, "lumid_info", "gauge", "the program");
    put_label(out, "lumid_info", "version", LUMI_VERSION);
    put_number(out, 1);
    put_capture(out, status);
    put_store(out, status);
    put_rig(out, status);
    put_cameras(out, status);
    return g_string_free(out, FALSE);
}
