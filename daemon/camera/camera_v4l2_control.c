/* V4L2 controls: exposure, gain, white balance, trigger, and by their names all the others. */
#include "daemon/camera/camera_v4l2_priv.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPOSURE_UNIT_S 100e-6 /* V4L2_CID_EXPOSURE_ABSOLUTE (ext-ctrls-camera) */

static bool query(const struct v4l2_camera *camera, uint32_t id, struct v4l2_queryctrl *control)
{
    memset(control, 0, sizeof *control);
    control->id = id;
    return v4l2_ioctl(camera->fd, VIDIOC_QUERYCTRL, control) == 0 && !(control->flags & V4L2_CTRL_FLAG_DISABLED);
}

static bool has(const struct v4l2_camera *camera, uint32_t id)
{
    struct v4l2_queryctrl control;

    return query(camera, id, &control);
}

static bool get(const struct v4l2_camera *camera, uint32_t id, int64_t *value)
{
    struct v4l2_ext_control control = {.id = id};
    struct v4l2_ext_controls controls = {.which = V4L2_CTRL_WHICH_CUR_VAL, .count = 1, .controls = &control};
    struct v4l2_queryctrl kind;

    if (!query(camera, id, &kind) || v4l2_ioctl(camera->fd, VIDIOC_G_EXT_CTRLS, &controls) != 0)
        return false;
    *value = kind.type == V4L2_CTRL_TYPE_INTEGER64 ? control.value64 : control.value;
    return true;
}

static int set(struct v4l2_camera *camera, uint32_t id, int64_t value, const char *name, struct lumi_error *error)
{
    struct v4l2_ext_control control = {.id = id, .value = (int32_t)value};
    struct v4l2_ext_controls controls = {.which = V4L2_CTRL_WHICH_CUR_VAL, .count = 1, .controls = &control};
    char doing[160];

    if (v4l2_ioctl(camera->fd, VIDIOC_S_EXT_CTRLS, &controls) == 0)
        return LUMI_OK;
    snprintf(doing, sizeof doing, "setting %s to %lld", name, (long long)value);
    return v4l2_fail(camera, error, doing);
}

/* ---- names ---- */

void v4l2_control_name(const char *name, char *option, size_t size)
{
    size_t length = 0;
    bool between = false;

    for (; *name && length + 2 < size; name++) {
        const bool digit = *name >= '0' && *name <= '9', upper = *name >= 'A' && *name <= 'Z';

        if (!digit && !upper && !(*name >= 'a' && *name <= 'z')) {
            between = length > 0;
            continue;
        }
        if (between)
            option[length++] = '_';
        between = false;
        option[length++] = (char)(upper ? *name - 'A' + 'a' : *name);
    }
    option[length] = '\0';
}

static bool find(const struct v4l2_camera *camera, const char *option, struct v4l2_queryctrl *control)
{
    char name[64];

    memset(control, 0, sizeof *control);
    control->id = V4L2_CTRL_FLAG_NEXT_CTRL;
    while (v4l2_ioctl(camera->fd, VIDIOC_QUERYCTRL, control) == 0) {
        v4l2_control_name((const char *)control->name, name, sizeof name);
        if (strcmp(name, option) == 0 && !(control->flags & V4L2_CTRL_FLAG_DISABLED))
            return true;
        control->id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    return false;
}

/* Of a menu: the item whose name begins with one of these words; −1: none. */
static int find_item(const struct v4l2_camera *camera, const struct v4l2_queryctrl *control, const char *const *words)
{
    for (int i = control->minimum; i <= control->maximum; i++) {
        struct v4l2_querymenu item = {.id = control->id, .index = (uint32_t)i};
        char name[40];

        if (v4l2_ioctl(camera->fd, VIDIOC_QUERYMENU, &item) != 0)
            continue;
        v4l2_control_name((const char *)item.name, name, sizeof name);
        for (const char *const *word = words; *word; word++)
            if (strncmp(name, *word, strlen(*word)) == 0)
                return i;
    }
    return -1;
}

static bool menu_has(const struct v4l2_camera *camera, uint32_t id, uint32_t index)
{
    struct v4l2_querymenu item = {.id = id, .index = index};

    return v4l2_ioctl(camera->fd, VIDIOC_QUERYMENU, &item) == 0;
}

/* ---- exposure and gain ---- */

static uint32_t gain_control(const struct v4l2_camera *camera)
{
    return has(camera, V4L2_CID_ANALOGUE_GAIN) ? V4L2_CID_ANALOGUE_GAIN
           : has(camera, V4L2_CID_GAIN)        ? V4L2_CID_GAIN
                                               : 0;
}

/* V4L2_CID_EXPOSURE counts a sensor's lines where the driver tells how long they are (ext-ctrls-image-process). */
static double line_length(const struct v4l2_camera *camera)
{
    int64_t rate, blank;

    if (has(camera, V4L2_CID_EXPOSURE_ABSOLUTE) || !has(camera, V4L2_CID_EXPOSURE) ||
        !get(camera, V4L2_CID_PIXEL_RATE, &rate) || !get(camera, V4L2_CID_HBLANK, &blank) || rate <= 0)
        return 0;
    return (double)(camera->format.width + blank) / (double)rate;
}

int v4l2_control_exposure(struct v4l2_camera *camera, double exposure_s, struct lumi_error *error)
{
    const bool absolute = has(camera, V4L2_CID_EXPOSURE_ABSOLUTE);
    const uint32_t id = absolute ? V4L2_CID_EXPOSURE_ABSOLUTE : V4L2_CID_EXPOSURE;
    const double unit = absolute ? EXPOSURE_UNIT_S : camera->line_s;
    struct v4l2_queryctrl control;
    double value;

    if (has(camera, V4L2_CID_EXPOSURE_AUTO)) {
        const uint32_t manual = menu_has(camera, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL)
                                    ? V4L2_EXPOSURE_MANUAL
                                    : V4L2_EXPOSURE_SHUTTER_PRIORITY;
        const uint32_t automatic = menu_has(camera, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO)
                                       ? V4L2_EXPOSURE_AUTO
                                       : V4L2_EXPOSURE_APERTURE_PRIORITY;

        LUMI_TRY(set(camera, V4L2_CID_EXPOSURE_AUTO, exposure_s > 0 ? manual : automatic, "exposure_auto", error));
    }
    if (exposure_s <= 0)
        return LUMI_OK;
    if (unit <= 0 || !query(camera, id, &control))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its exposure time cannot be set",
                         camera->camera.identity.address);
    if (has(camera, V4L2_CID_EXPOSURE_AUTO_PRIORITY)) /* otherwise it lengthens frames in the dark */
        LUMI_TRY(set(camera, V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "exposure_auto_priority", error));
    value = round(exposure_s / unit);
    if (value < control.minimum || value > control.maximum)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: an exposure of %g s: it takes %g to %g s",
                         camera->camera.identity.address, exposure_s, control.minimum * unit, control.maximum * unit);
    return set(camera, id, (int64_t)value, "exposure", error);
}

int v4l2_control_gain(struct v4l2_camera *camera, double gain, struct lumi_error *error)
{
    const uint32_t id = gain_control(camera);
    struct v4l2_queryctrl control;
    double value;

    if (has(camera, V4L2_CID_AUTOGAIN))
        LUMI_TRY(set(camera, V4L2_CID_AUTOGAIN, gain <= 0, "gain_automatic", error));
    if (gain <= 0)
        return LUMI_OK;
    if (!id || !query(camera, id, &control))
        return gain == 1 ? LUMI_OK
                         : lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its gain cannot be set",
                                     camera->camera.identity.address);
    /* What a step of the control means only the maker knows: its lowest is taken for 1. */
    if (gain != 1 && camera->gain_unit <= 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "%s: a gain of %g: its control goes from %d to %d; the option GainUnit=N says which is gain 1",
                         camera->camera.identity.address, gain, control.minimum, control.maximum);
    value = camera->gain_unit > 0 ? round(gain * camera->gain_unit) : control.minimum;
    if (value < control.minimum || value > control.maximum)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: a gain of %g: its control goes from %d to %d",
                         camera->camera.identity.address, gain, control.minimum, control.maximum);
    return set(camera, id, (int64_t)value, "gain", error);
}

void v4l2_control_read(struct v4l2_camera *camera, double *exposure_s, double *gain)
{
    const uint32_t gain_id = gain_control(camera);
    struct v4l2_queryctrl control;
    int64_t value;

    *exposure_s = *gain = 0;
    if (get(camera, V4L2_CID_EXPOSURE_ABSOLUTE, &value))
        *exposure_s = (double)value * EXPOSURE_UNIT_S;
    else if (camera->line_s > 0 && get(camera, V4L2_CID_EXPOSURE, &value))
        *exposure_s = (double)value * camera->line_s;
    if (!gain_id || !get(camera, gain_id, &value))
        return;
    if (camera->gain_unit > 0)
        *gain = (double)value / camera->gain_unit;
    else if (query(camera, gain_id, &control) && value == control.minimum)
        *gain = 1;
}

static int apply_white_balance(struct v4l2_camera *camera, double kelvin, struct lumi_error *error)
{
    struct v4l2_queryctrl control;

    if (has(camera, V4L2_CID_AUTO_WHITE_BALANCE))
        LUMI_TRY(set(camera, V4L2_CID_AUTO_WHITE_BALANCE, kelvin <= 0, "white_balance_automatic", error));
    if (kelvin <= 0)
        return LUMI_OK;
    if (!query(camera, V4L2_CID_WHITE_BALANCE_TEMPERATURE, &control))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its white balance cannot be set",
                         camera->camera.identity.address);
    if (kelvin < control.minimum || kelvin > control.maximum)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: a white balance of %g K: it takes %d to %d K",
                         camera->camera.identity.address, kelvin, control.minimum, control.maximum);
    return set(camera, V4L2_CID_WHITE_BALANCE_TEMPERATURE, (int64_t)kelvin, "white_balance_temperature", error);
}

/* ---- trigger: V4L2 has no control of its own for it; drivers that trigger name theirs like this ---- */

static bool trigger_mode(const struct v4l2_camera *camera, struct v4l2_queryctrl *control)
{
    return find(camera, "trigger_mode", control) || find(camera, "trigger", control);
}

static bool trigger_button(const struct v4l2_camera *camera, struct v4l2_queryctrl *control)
{
    return find(camera, "software_trigger", control) || find(camera, "trigger_software", control);
}

static int apply_trigger(struct v4l2_camera *camera, enum lumi_camera_trigger trigger, struct lumi_error *error)
{
    static const char *const words[3][6] = {[LUMI_TRIGGER_FREE] = {"off", "free", "disabled", "internal", "master"},
                                            [LUMI_TRIGGER_HARDWARE] = {"hardware", "external", "on", "enabled"},
                                            [LUMI_TRIGGER_SOFTWARE] = {"software"}};
    struct v4l2_queryctrl mode;
    int value = trigger == LUMI_TRIGGER_FREE ? 0 : trigger == LUMI_TRIGGER_HARDWARE ? 1 : -1;

    if (!trigger_mode(camera, &mode))
        return trigger == LUMI_TRIGGER_FREE ? LUMI_OK
                                            : lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its driver has no trigger",
                                                        camera->camera.identity.address);
    if (mode.type == V4L2_CTRL_TYPE_MENU)
        value = find_item(camera, &mode, words[trigger]);
    else if (trigger == LUMI_TRIGGER_SOFTWARE)
        value = 1;
    if (value < 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its driver's %s has no such mode",
                         camera->camera.identity.address, (const char *)mode.name);
    return set(camera, mode.id, value, (const char *)mode.name, error);
}

int v4l2_control_trigger(struct v4l2_camera *camera, struct lumi_error *error)
{
    struct v4l2_queryctrl button;

    if (camera->setting.trigger != LUMI_TRIGGER_SOFTWARE || !trigger_button(camera, &button))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: is not set to a trigger by software",
                         camera->camera.identity.address);
    return set(camera, button.id, 1, (const char *)button.name, error);
}

void v4l2_control_identify(struct v4l2_camera *camera)
{
    struct lumi_camera_identity *identity = &camera->camera.identity;
    struct v4l2_queryctrl control;

    camera->line_s = line_length(camera);
    identity->exposure_control = has(camera, V4L2_CID_EXPOSURE_ABSOLUTE) || camera->line_s > 0;
    identity->gain_control = gain_control(camera) != 0;
    identity->white_balance_control = has(camera, V4L2_CID_WHITE_BALANCE_TEMPERATURE);
    identity->hardware_trigger = trigger_mode(camera, &control);
    identity->software_trigger = trigger_button(camera, &control);
}

/* ---- options ---- */

static int apply_option(struct v4l2_camera *camera, const struct camera_option *option, struct lumi_error *error)
{
    struct v4l2_queryctrl control;
    char *end;
    const double value = strtod(option->value, &end);
    const bool number = end != option->value && *end == '\0' && isfinite(value);

    if (strcmp(option->name, V4L2_OPTION_FORMAT) == 0)
        return LUMI_OK; /* done with when the format was chosen */
    if (!number || value < -2147483648.0 || value > 2147483647.0)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: option %s=%s: a number is needed", camera->camera.identity.address,
                         option->name, option->value);
    if (strcmp(option->name, "GainUnit") == 0) {
        if (value <= 0)
            return lumi_fail(error, LUMI_ERR_ARG, "%s: option GainUnit=%s: must be above 0",
                             camera->camera.identity.address, option->value);
        camera->gain_unit = value;
        return LUMI_OK;
    }
    if (!find(camera, option->name, &control))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: option %s: it has no such control", camera->camera.identity.address,
                         option->name);
    if (value < control.minimum || value > control.maximum)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: option %s=%s: it takes %d to %d", camera->camera.identity.address,
                         option->name, option->value, control.minimum, control.maximum);
    return set(camera, control.id, (int64_t)value, option->name, error);
}

int v4l2_control_apply(struct v4l2_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    const char *text = setting->options;
    struct camera_option option;
    int more;

    camera->gain_unit = 0;
    while ((more = camera_option_next(&text, &option, error)) > 0)
        LUMI_TRY(apply_option(camera, &option, error));
    LUMI_TRY(more);
    camera->line_s = line_length(camera);
    LUMI_TRY(apply_trigger(camera, setting->trigger, error));
    LUMI_TRY(v4l2_control_exposure(camera, setting->exposure_s, error));
    LUMI_TRY(v4l2_control_gain(camera, setting->gain, error));
    return apply_white_balance(camera, setting->white_balance, error);
}
