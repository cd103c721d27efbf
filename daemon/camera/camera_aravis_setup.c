/* What a GenICam camera can do, and setting it up: format, exposure, trigger, chunk data, the caller's own features. */
#include "daemon/camera/camera_aravis_priv.h"

#include <arpa/inet.h>
#include <math.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define ACTION_DEVICE 0x4c756d69 /* keys of our action commands; the camera gets the same */
#define PIXEL_FORMATS 64

/* Every call of Aravis that can fail: LUMI_TRY for it. */
#define TRY_ARV(camera, doing, call)                                                                                   \
    do {                                                                                                               \
        GError *problem = NULL;                                                                                        \
        call;                                                                                                          \
        if (problem)                                                                                                   \
            return aravis_fail(camera, problem, doing, error);                                                         \
    } while (0)

double aravis_gain_from(const struct aravis_camera *camera, double value)
{
    return camera->gain_in_db ? pow(10, value / 20) : value;
}

double aravis_gain_to(const struct aravis_camera *camera, double gain)
{
    return camera->gain_in_db ? 20 * log10(gain) : gain;
}

/* ---- what it can do ---- */

static void copy_feature(struct aravis_camera *camera, const char *feature, char *to, size_t room)
{
    const char *text = aravis_has(camera, feature) ? arv_camera_get_string(camera->camera, feature, NULL) : NULL;

    if (text && text[0])
        g_strlcpy(to, text, room);
}

static bool has_entry(struct aravis_camera *camera, const char *feature, const char *entry)
{
    return arv_camera_is_enumeration_entry_available(camera->camera, feature, entry, NULL);
}

/* The first input that is a line, or "": none. */
static void first_line(struct aravis_camera *camera, char *input, size_t room)
{
    guint count = 0;
    g_autofree const char **sources = arv_camera_dup_available_trigger_sources(camera->camera, &count, NULL);

    input[0] = '\0';
    if (has_entry(camera, "TriggerSource", "Line1"))
        g_strlcpy(input, "Line1", room);
    for (guint i = 0; i < count && input[0] == '\0'; i++)
        if (strncmp(sources[i], "Line", 4) == 0)
            g_strlcpy(input, sources[i], room);
}

static void identify_clock(struct aravis_camera *camera)
{
    struct lumi_camera_identity *identity = &camera->base.identity;
    ArvDevice *device = arv_camera_get_device(camera->camera);
    uint64_t frequency = 1000000000; /* USB3 Vision: ns */

    if (ARV_IS_GV_DEVICE(device))
        frequency = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), NULL);
    identity->device_clock = frequency > 0;
    identity->clock_step_ns = frequency > 0 ? 1e9 / (double)frequency : 0;
}

void aravis_identify(struct aravis_camera *camera)
{
    struct lumi_camera_identity *identity = &camera->base.identity;
    ArvGcNode *gain = arv_device_get_feature(arv_camera_get_device(camera->camera), "Gain");
    const char *unit = ARV_IS_GC_FLOAT(gain) ? arv_gc_float_get_unit(ARV_GC_FLOAT(gain)) : NULL;
    char line[32];

    copy_feature(camera, "DeviceVendorName", identity->vendor, sizeof identity->vendor);
    copy_feature(camera, "DeviceModelName", identity->model, sizeof identity->model);
    copy_feature(camera, "DeviceFirmwareVersion", identity->firmware, sizeof identity->firmware);
    if (identity->serial[0] == '\0') {
        const char *serial = arv_camera_get_device_serial_number(camera->camera, NULL);
        g_strlcpy(identity->serial, serial && serial[0] ? serial : identity->address, sizeof identity->serial);
    }
    first_line(camera, line, sizeof line);
    identity->hardware_trigger = line[0] != '\0';
    identity->software_trigger = has_entry(camera, "TriggerSource", "Software");
    identity->action_command = has_entry(camera, "TriggerSource", "Action1");
    identity->exposure_control = arv_camera_is_exposure_time_available(camera->camera, NULL);
    /* SFNC has it in dB; a camera whose gain is a bare number says no unit and means a factor only if it says so. */
    identity->gain_control = ARV_IS_GC_FLOAT(gain);
    camera->gain_in_db = !(unit && (strcmp(unit, "x") == 0 || strcmp(unit, "factor") == 0));
    identity->white_balance_control = aravis_has(camera, "ColorTemperature");
    identify_clock(camera);
}

/* ---- picture ---- */

/* How much a format is wanted; 0: not at all. */
static int rank(const struct aravis_pixels *pixels, const struct lumi_camera_setting *setting)
{
    const bool raw = pixels->layout == LUMI_LAYOUT_BAYER || pixels->layout == LUMI_LAYOUT_GREY;
    int score = 1;

    if (setting->layout != LUMI_LAYOUT_NONE && setting->layout != pixels->layout)
        return 0;
    if (setting->bits > 0 && raw && setting->bits != pixels->bits)
        return 0;
    if (setting->layout == LUMI_LAYOUT_NONE)
        score += pixels->layout == LUMI_LAYOUT_BAYER  ? 4000
                 : pixels->layout == LUMI_LAYOUT_GREY ? 3000
                 : pixels->layout == LUMI_LAYOUT_JPEG ? 2000
                                                      : 1000;
    score += 10 * pixels->bits; /* and of the same depth, packed: the line is what is narrow */
    return score + (pixels->packing == ARAVIS_LSB ? 2 : pixels->packing == ARAVIS_GVSP ? 1 : 0);
}

static int choose_pixels(struct aravis_camera *camera, const struct lumi_camera_setting *setting,
                         struct lumi_error *error)
{
    g_autoptr(GString) had = g_string_new(NULL);
    g_autofree const char **names = NULL;
    const char *chosen = NULL;
    int best = 0;
    guint count = 0;

    TRY_ARV(camera, "its pixel formats",
            names = arv_camera_dup_available_pixel_formats_as_strings(camera->camera, &count, &problem));
    for (guint i = 0; i < count && i < PIXEL_FORMATS; i++) {
        struct aravis_pixels pixels;
        g_string_append_printf(had, "%s%s", i ? ", " : "", names[i]);
        if (!aravis_pixels_of_name(names[i], &pixels) || rank(&pixels, setting) <= best)
            continue;
        best = rank(&pixels, setting);
        chosen = names[i];
        camera->pixels = pixels;
    }
    if (!chosen)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: no pixel format as it is wanted; it has %s",
                         camera->base.identity.serial, had->str);
    TRY_ARV(camera, "its pixel format", arv_camera_set_pixel_format_from_string(camera->camera, chosen, &problem));
    return LUMI_OK;
}

static int set_region(struct aravis_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    int x, y, least, width, height, widest, highest;

    if (arv_camera_is_region_offset_available(camera->camera, NULL))
        TRY_ARV(camera, "its place on the sensor", arv_camera_set_region(camera->camera, 0, 0, -1, -1, &problem));
    TRY_ARV(camera, "its width", arv_camera_get_width_bounds(camera->camera, &least, &widest, &problem));
    TRY_ARV(camera, "its height", arv_camera_get_height_bounds(camera->camera, &least, &highest, &problem));
    width = setting->width > 0 ? setting->width : widest;
    height = setting->height > 0 ? setting->height : highest;
    if (width > widest || height > highest)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: %d × %d pixels; it has %d × %d",
                         camera->base.identity.serial, width, height, widest, highest);
    TRY_ARV(camera, "its size", arv_camera_set_region(camera->camera, -1, -1, width, height, &problem));
    TRY_ARV(camera, "its size", arv_camera_get_region(camera->camera, &x, &y, &width, &height, &problem));
    if ((setting->width > 0 && width != setting->width) || (setting->height > 0 && height != setting->height))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: takes %d × %d pixels instead",
                         camera->base.identity.serial, width, height);
    camera->format = (struct lumi_frame_format){.width = width, .height = height};
    aravis_format(&camera->pixels, &camera->format);
    return LUMI_OK;
}

/* ---- exposure ---- */

static int set_exposure(struct aravis_camera *camera, double exposure_s, struct lumi_error *error)
{
    double shortest, longest, want = exposure_s * 1e6;

    if (exposure_s <= 0) {
        if (arv_camera_is_exposure_auto_available(camera->camera, NULL))
            TRY_ARV(camera, "its own exposure",
                    arv_camera_set_exposure_time_auto(camera->camera, ARV_AUTO_CONTINUOUS, &problem));
    } else {
        if (arv_camera_is_exposure_auto_available(camera->camera, NULL))
            TRY_ARV(camera, "a fixed exposure",
                    arv_camera_set_exposure_time_auto(camera->camera, ARV_AUTO_OFF, &problem));
        TRY_ARV(camera, "its exposure times",
                arv_camera_get_exposure_time_bounds(camera->camera, &shortest, &longest, &problem));
        if (want < shortest || want > longest)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: exposes %g to %g s, not %g",
                             camera->base.identity.serial, shortest * 1e-6, longest * 1e-6, exposure_s);
        TRY_ARV(camera, "its exposure", arv_camera_set_exposure_time(camera->camera, want, &problem));
    }
    if (camera->base.identity.exposure_control)
        TRY_ARV(camera, "its exposure",
                camera->set_exposure = 1e-6 * arv_camera_get_exposure_time(camera->camera, &problem));
    return LUMI_OK;
}

static int set_gain(struct aravis_camera *camera, double gain, struct lumi_error *error)
{
    double least, most, want = gain > 0 ? aravis_gain_to(camera, gain) : 0;

    if (!camera->base.identity.gain_control)
        return gain <= 0 ? LUMI_OK
                         : lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: its gain cannot be set",
                                     camera->base.identity.serial);
    if (arv_camera_is_gain_auto_available(camera->camera, NULL))
        TRY_ARV(camera, "its own gain",
                arv_camera_set_gain_auto(camera->camera, gain > 0 ? ARV_AUTO_OFF : ARV_AUTO_CONTINUOUS, &problem));
    if (gain > 0) {
        TRY_ARV(camera, "its gains", arv_camera_get_gain_bounds(camera->camera, &least, &most, &problem));
        if (want < least - 1e-6 || want > most + 1e-6)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: amplifies %.3g to %.3g times, not %g",
                             camera->base.identity.serial, aravis_gain_from(camera, least),
                             aravis_gain_from(camera, most), gain);
        TRY_ARV(camera, "its gain", arv_camera_set_gain(camera->camera, CLAMP(want, least, most), &problem));
    }
    TRY_ARV(camera, "its gain",
            camera->set_gain = aravis_gain_from(camera, arv_camera_get_gain(camera->camera, &problem)));
    return LUMI_OK;
}

int aravis_expose(struct lumi_camera *base, double exposure_s, double gain, struct lumi_error *error)
{
    struct aravis_camera *camera = (struct aravis_camera *)base;

    if (exposure_s > 0)
        LUMI_TRY(set_exposure(camera, exposure_s, error));
    return gain > 0 ? set_gain(camera, gain, error) : LUMI_OK;
}

static int set_white_balance(struct aravis_camera *camera, double kelvin, struct lumi_error *error)
{
    if (kelvin <= 0)
        return LUMI_OK;
    if (!camera->base.identity.white_balance_control)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "camera %s: knows no colour temperature (options can set its own features: "
                         "BalanceRatioSelector=Red BalanceRatio=1.6)",
                         camera->base.identity.serial);
    if (has_entry(camera, "BalanceWhiteAuto", "Off"))
        TRY_ARV(camera, "its white balance",
                arv_camera_set_string(camera->camera, "BalanceWhiteAuto", "Off", &problem));
    TRY_ARV(camera, "its white balance", arv_camera_set_float(camera->camera, "ColorTemperature", kelvin, &problem));
    return LUMI_OK;
}

/* ---- trigger ---- */

static int set_action(struct aravis_camera *camera, struct lumi_error *error)
{
    if (aravis_has(camera, "ActionSelector"))
        TRY_ARV(camera, "its action", arv_camera_set_integer(camera->camera, "ActionSelector", 1, &problem));
    TRY_ARV(camera, "its action's key",
            arv_camera_set_integer(camera->camera, "ActionDeviceKey", camera->action_device, &problem));
    TRY_ARV(camera, "its action's group",
            arv_camera_set_integer(camera->camera, "ActionGroupKey", camera->action_group, &problem));
    TRY_ARV(camera, "its action's mask",
            arv_camera_set_integer(camera->camera, "ActionGroupMask", camera->action_mask, &problem));
    return LUMI_OK;
}

static int set_trigger(struct aravis_camera *camera, const struct lumi_camera_setting *setting,
                       struct lumi_error *error)
{
    char input[32];

    g_strlcpy(input, setting->trigger_input, sizeof input);
    if (setting->trigger == LUMI_TRIGGER_FREE) {
        TRY_ARV(camera, "running free", arv_camera_clear_triggers(camera->camera, &problem));
        if (setting->frame_rate > 0)
            TRY_ARV(camera, "its frame rate", arv_camera_set_frame_rate(camera->camera, setting->frame_rate, &problem));
        return LUMI_OK;
    }
    if (setting->trigger == LUMI_TRIGGER_SOFTWARE && strncmp(input, "Action", 6) != 0)
        g_strlcpy(input, "Software", sizeof input);
    else if (input[0] == '\0')
        first_line(camera, input, sizeof input);
    if (!has_entry(camera, "TriggerSource", input))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: cannot be triggered by \"%s\"",
                         camera->base.identity.serial, input[0] ? input : "a line");
    if (strncmp(input, "Action", 6) == 0)
        LUMI_TRY(set_action(camera, error));
    TRY_ARV(camera, "its trigger", arv_camera_set_trigger(camera->camera, input, &problem));
    if (setting->trigger_falling)
        TRY_ARV(camera, "its trigger's edge",
                arv_camera_set_string(camera->camera, "TriggerActivation", "FallingEdge", &problem));
    return LUMI_OK;
}

int aravis_action(struct aravis_camera *camera, struct lumi_error *error)
{
    static uint16_t id = 1;
    const uint32_t words[3] = {htonl(camera->action_device), htonl(camera->action_group), htonl(camera->action_mask)};
    /* GigE Vision 2.0, 16.9: ACTION_CMD 0x0100, no answer asked for, 12 bytes: device key, group key, group mask. */
    uint8_t packet[20] = {0x42, 0, 1, 0, 0, 12, (uint8_t)(id >> 8), (uint8_t)id};
    struct sockaddr_in to = {.sin_family = AF_INET, .sin_port = htons(3956)};
    int fd;

    id = id == UINT16_MAX ? 1 : (uint16_t)(id + 1);
    memcpy(packet + 8, words, sizeof words);
    if (inet_pton(AF_INET, camera->base.identity.address, &to.sin_addr) != 1)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: action commands go over a network",
                         camera->base.identity.serial);
    fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || sendto(fd, packet, sizeof packet, 0, (struct sockaddr *)&to, sizeof to) != (ssize_t)sizeof packet) {
        lumi_fail_errno(error, camera->base.identity.address, "sending an action command");
        if (fd >= 0)
            close(fd);
        return LUMI_ERR_IO;
    }
    close(fd);
    return LUMI_OK;
}

/* ---- chunk data ---- */

/* The first of the pairs (selector's entry, feature in the chunk) that the camera has, switched on; NULL: none. */
static const char *enable_chunk(struct aravis_camera *camera, const char *const (*pairs)[2], size_t count)
{
    for (size_t i = 0; i < count; i++) {
        g_autoptr(GError) problem = NULL;

        if (!has_entry(camera, "ChunkSelector", pairs[i][0]) ||
            !arv_device_get_feature(arv_camera_get_device(camera->camera), pairs[i][1]))
            continue;
        arv_camera_set_chunk_state(camera->camera, pairs[i][0], TRUE, &problem);
        if (!problem)
            return pairs[i][1];
    }
    return NULL;
}

/* A counter that counts triggers, where CounterValue comes with a frame (SFNC 2.7, 14.2). */
static void count_triggers(struct aravis_camera *camera)
{
    static const char *const events[] = {"FrameTrigger", "Line1", "AcquisitionTrigger"};

    if (has_entry(camera, "CounterSelector", "Counter0"))
        arv_camera_set_string(camera->camera, "CounterSelector", "Counter0", NULL);
    for (size_t i = 0; i < G_N_ELEMENTS(events); i++)
        if (has_entry(camera, "CounterEventSource", events[i])) {
            arv_camera_set_string(camera->camera, "CounterEventSource", events[i], NULL);
            return;
        }
}

static int set_chunks(struct aravis_camera *camera, bool wanted, struct lumi_error *error)
{
    static const char *const exposures[][2] = {{"ExposureTime", "ChunkExposureTime"}};
    static const char *const gains[][2] = {{"Gain", "ChunkGain"}, {"GainAll", "ChunkGainAll"}};
    static const char *const triggers[][2] = {{"Triggerinputcounter", "ChunkTriggerinputcounter"},
                                              {"TriggerCounter", "ChunkTriggerCounter"},
                                              {"CounterValue", "ChunkCounterValue"}};

    g_clear_object(&camera->chunks);
    camera->chunk_exposure = camera->chunk_gain = camera->chunk_trigger = NULL;
    if (!arv_camera_are_chunks_available(camera->camera, NULL))
        return LUMI_OK;
    TRY_ARV(camera, "its chunk data", arv_camera_set_chunk_mode(camera->camera, wanted, &problem));
    if (!wanted)
        return LUMI_OK;
    camera->chunk_exposure = enable_chunk(camera, exposures, G_N_ELEMENTS(exposures));
    camera->chunk_gain = enable_chunk(camera, gains, G_N_ELEMENTS(gains));
    count_triggers(camera);
    camera->chunk_trigger = enable_chunk(camera, triggers, G_N_ELEMENTS(triggers));
    camera->chunks = aravis_chunk_parser(camera->camera);
    return LUMI_OK;
}

/* ---- options ---- */

static int whole_number(const struct camera_option *option, long least, long most, int *value, struct lumi_error *error)
{
    char *end;
    const long number = strtol(option->value, &end, 0);

    if (*end || end == option->value || number < least || number > most)
        return lumi_fail(error, LUMI_ERR_ARG, "camera option %s: %ld to %ld wanted, not \"%s\"", option->name, least,
                         most, option->value);
    *value = (int)number;
    return LUMI_OK;
}

/* 1: it was one of ours. */
static int own_option(struct aravis_camera *camera, const struct camera_option *o, struct lumi_error *error)
{
    const struct {
        const char *name;
        int *value;
        long least, most;
    } numbers[] = {{"PacketSize", &camera->packet_size, 220, 16384},
                   {"PacketDelay", &camera->packet_delay, 0, 1000000000},
                   {"PacketTimeout", &camera->packet_timeout_us, 100, 10000000},
                   {"FrameRetention", &camera->frame_retention_us, 1000, 60000000}};

    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        if (strcmp(o->name, numbers[i].name) == 0) {
            LUMI_TRY(whole_number(o, numbers[i].least, numbers[i].most, numbers[i].value, error));
            return 1;
        }
    if (strcmp(o->name, "PacketResend") != 0)
        return 0;
    if (strcmp(o->value, "Always") != 0 && strcmp(o->value, "Never") != 0)
        return lumi_fail(error, LUMI_ERR_ARG, "camera option PacketResend: Always or Never wanted, not \"%s\"",
                         o->value);
    camera->packet_resend = strcmp(o->value, "Always") == 0;
    return 1;
}

static int set_feature(struct aravis_camera *camera, const struct camera_option *option, struct lumi_error *error)
{
    g_autofree char *text = g_strdup_printf("%s=%s", option->name, option->value);
    ArvGcNode *node = arv_device_get_feature(arv_camera_get_device(camera->camera), option->name);

    if (!ARV_IS_GC_FEATURE_NODE(node))
        return lumi_fail(error, LUMI_ERR_ARG, "camera %s: has no feature \"%s\"", camera->base.identity.serial,
                         option->name);
    TRY_ARV(camera, option->name,
            arv_device_set_features_from_string(arv_camera_get_device(camera->camera), text, &problem));
    return LUMI_OK;
}

static int set_options(struct aravis_camera *camera, const char *text, struct lumi_error *error)
{
    struct camera_option option;
    int more;

    camera->packet_size = camera->packet_delay = camera->packet_timeout_us = camera->frame_retention_us = 0;
    camera->packet_resend = true;
    while ((more = camera_option_next(&text, &option, error)) > 0) {
        const int ours = own_option(camera, &option, error);

        if (ours < 0)
            return ours;
        if (!ours)
            LUMI_TRY(set_feature(camera, &option, error));
    }
    if (more < 0 || !arv_camera_is_gv_device(camera->camera))
        return more;
    arv_camera_gv_set_packet_size_adjustment(camera->camera, camera->packet_size > 0
                                                                 ? ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER
                                                                 : ARV_GV_PACKET_SIZE_ADJUSTMENT_ON_FAILURE_ONCE);
    if (camera->packet_size > 0)
        TRY_ARV(camera, "its packet size",
                arv_camera_gv_set_packet_size(camera->camera, camera->packet_size, &problem));
    if (camera->packet_delay > 0)
        TRY_ARV(camera, "its packet delay",
                arv_camera_gv_set_packet_delay(camera->camera, camera->packet_delay, &problem));
    return LUMI_OK;
}

/* ---- all of it ---- */

int aravis_configure(struct lumi_camera *base, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    struct aravis_camera *camera = (struct aravis_camera *)base;

    if (camera->stream)
        return lumi_fail(error, LUMI_ERR_ARG, "camera %s: configured while it is armed", base->identity.serial);
    if (setting->dmabuf)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: has no dmabuf", base->identity.serial);
    camera->configured = false;
    camera->action_device = ACTION_DEVICE;
    camera->action_group = camera->action_mask = 1;
    LUMI_TRY(choose_pixels(camera, setting, error));
    LUMI_TRY(set_region(camera, setting, error));
    if (aravis_has(camera, "AcquisitionMode"))
        TRY_ARV(camera, "running on",
                arv_camera_set_acquisition_mode(camera->camera, ARV_ACQUISITION_MODE_CONTINUOUS, &problem));
    LUMI_TRY(set_trigger(camera, setting, error));
    LUMI_TRY(set_exposure(camera, setting->exposure_s, error));
    LUMI_TRY(set_gain(camera, setting->gain, error));
    LUMI_TRY(set_white_balance(camera, setting->white_balance, error));
    LUMI_TRY(set_chunks(camera, setting->chunk_data, error));
    LUMI_TRY(set_options(camera, setting->options, error));
    camera->setting = *setting;
    camera->configured = true;
    return LUMI_OK;
}
