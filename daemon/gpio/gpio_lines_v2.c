/* libgpiod 2: edges are numbered by the kernel, line by line, and it debounces. */
#include "daemon/gpio/gpio_lines.h"

#include <dirent.h>
#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EVENTS 16

struct lumi_gpio_held {
    struct gpiod_line_request *request;
    struct gpiod_edge_event_buffer *buffer;
    unsigned offset;
    unsigned long seen; /* number of the last edge */
};

/* A chip whose label it is. */
static struct gpiod_chip *open_labelled(const char *label)
{
    DIR *folder = opendir("/dev");
    struct gpiod_chip *found = NULL;

    for (struct dirent *entry; folder && !found && (entry = readdir(folder));) {
        char path[300];
        if (strncmp(entry->d_name, "gpiochip", 8) != 0)
            continue;
        snprintf(path, sizeof path, "/dev/%s", entry->d_name);
        struct gpiod_chip *chip = gpiod_chip_open(path);
        struct gpiod_chip_info *info = chip ? gpiod_chip_get_info(chip) : NULL;
        if (info && strcmp(gpiod_chip_info_get_label(info), label) == 0)
            found = chip;
        else if (chip)
            gpiod_chip_close(chip);
        gpiod_chip_info_free(info);
    }
    if (folder)
        closedir(folder);
    return found;
}

static struct gpiod_chip *open_chip(const char *name)
{
    char path[80];

    snprintf(path, sizeof path, "%s%s", *name == '/' ? "" : "/dev/", name);
    struct gpiod_chip *chip = gpiod_chip_open(path);
    return chip ? chip : open_labelled(name);
}

static struct gpiod_line_settings *settings_for(const struct lumi_gpio_line *line)
{
    struct gpiod_line_settings *settings = gpiod_line_settings_new();
    bool input = line->role == LUMI_GPIO_ESTOP || line->role == LUMI_GPIO_SYNC;

    if (!settings)
        return NULL;
    gpiod_line_settings_set_direction(settings, input ? GPIOD_LINE_DIRECTION_INPUT : GPIOD_LINE_DIRECTION_OUTPUT);
    gpiod_line_settings_set_active_low(settings, line->active_low);
    if (input) {
        gpiod_line_settings_set_edge_detection(settings, GPIOD_LINE_EDGE_BOTH);
        gpiod_line_settings_set_event_clock(settings, GPIOD_LINE_CLOCK_MONOTONIC);
        gpiod_line_settings_set_debounce_period_us(settings, (unsigned long)line->debounce_us);
    } else
        gpiod_line_settings_set_output_value(settings, line->role == LUMI_GPIO_POWER ? GPIOD_LINE_VALUE_ACTIVE
                                                                                     : GPIOD_LINE_VALUE_INACTIVE);
    return settings;
}

static struct gpiod_line_request *ask(struct gpiod_chip *chip, unsigned offset, const struct lumi_gpio_line *line)
{
    struct gpiod_line_settings *settings = settings_for(line);
    struct gpiod_line_config *config = gpiod_line_config_new();
    struct gpiod_request_config *who = gpiod_request_config_new();
    struct gpiod_line_request *request = NULL;

    if (settings && config && who && gpiod_line_config_add_line_settings(config, &offset, 1, settings) == 0) {
        gpiod_request_config_set_consumer(who, LUMI_GPIO_CONSUMER);
        gpiod_request_config_set_event_buffer_size(who, 1024);
        request = gpiod_chip_request_lines(chip, who, config);
    }
    int saved = errno;
    gpiod_request_config_free(who);
    gpiod_line_config_free(config);
    gpiod_line_settings_free(settings);
    errno = saved;
    return request;
}

int lumi_gpio_hold(const struct lumi_gpio_line *line, struct lumi_gpio_held **held, struct lumi_error *error)
{
    struct lumi_gpio_held *made = calloc(1, sizeof *made);
    struct gpiod_chip *chip = NULL;
    int offset = line->offset, code = LUMI_OK;
    char text[160];

    lumi_gpio_line_text(line, text, sizeof text);
    if (!made || !(made->buffer = gpiod_edge_event_buffer_new(EVENTS)))
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", text);
    else if (!(chip = open_chip(line->chip)))
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no chip %s", text, line->chip);
    else if (offset < 0 && (offset = gpiod_chip_get_line_offset_from_name(chip, line->line_name)) < 0)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: the chip has no such line", text);
    else if (!(made->request = ask(chip, (unsigned)offset, line)))
        code = errno == EBUSY    ? lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it", text)
               : errno == EINVAL ? lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: the chip has no such line", text)
                                 : lumi_fail(error, LUMI_ERR_IO, "%s: it cannot be had: %s", text, strerror(errno));
    if (chip)
        gpiod_chip_close(chip);
    if (code == LUMI_OK) {
        made->offset = (unsigned)offset;
        *held = made;
    } else if (made) {
        gpiod_edge_event_buffer_free(made->buffer);
        free(made);
    }
    return code;
}

void lumi_gpio_release(struct lumi_gpio_held *held)
{
    gpiod_line_request_release(held->request);
    gpiod_edge_event_buffer_free(held->buffer);
    free(held);
}

int lumi_gpio_held_fd(struct lumi_gpio_held *held)
{
    return gpiod_line_request_get_fd(held->request);
}

int lumi_gpio_held_read(struct lumi_gpio_held *held, struct lumi_gpio_event *events, int max)
{
    int count =
        gpiod_line_request_read_edge_events(held->request, held->buffer, max < EVENTS ? (size_t)max : (size_t)EVENTS);

    if (count <= 0)
        return count < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : LUMI_ERR_IO;
    for (int i = 0; i < count; i++) {
        struct gpiod_edge_event *event = gpiod_edge_event_buffer_get_event(held->buffer, (unsigned long)i);
        unsigned long number = gpiod_edge_event_get_line_seqno(event);
        events[i] =
            (struct lumi_gpio_event){.active = gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE,
                                     .at_ns = (int64_t)gpiod_edge_event_get_timestamp_ns(event),
                                     .lost = number > held->seen + 1 ? (uint32_t)(number - held->seen - 1) : 0};
        held->seen = number;
    }
    return count;
}

int lumi_gpio_held_get(struct lumi_gpio_held *held)
{
    enum gpiod_line_value value = gpiod_line_request_get_value(held->request, held->offset);

    return value == GPIOD_LINE_VALUE_ERROR ? -1 : value == GPIOD_LINE_VALUE_ACTIVE;
}

int lumi_gpio_held_set(struct lumi_gpio_held *held, bool active)
{
    return gpiod_line_request_set_value(held->request, held->offset,
                                        active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE);
}

const char *lumi_gpio_library(void)
{
    static char text[64];

    snprintf(text, sizeof text, "libgpiod %s", gpiod_api_version());
    return text;
}
