/* libgpiod 1.6. The kernel's first interface has no numbers for edges, so what its queue of 16 dropped is seen only
 * where two edges of one direction follow each other; and it debounces nothing. */
#include "daemon/gpio/gpio_lines.h"

#include <errno.h>
#include <gpiod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct lumi_gpio_held {
    struct gpiod_chip *chip;
    struct gpiod_line *line;
    bool known, active; /* the last edge's direction */
};

static struct gpiod_line *find(struct gpiod_chip *chip, const struct lumi_gpio_line *line)
{
    if (line->offset < 0)
        return gpiod_chip_find_line(chip, line->line_name);
    return gpiod_chip_get_line(chip, (unsigned)line->offset);
}

int lumi_gpio_hold(const struct lumi_gpio_line *line, struct lumi_gpio_held **held, struct lumi_error *error)
{
    struct lumi_gpio_held *made = calloc(1, sizeof *made);
    int flags = line->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0, code = LUMI_OK;
    char text[160];

    lumi_gpio_line_text(line, text, sizeof text);
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", text);
    made->chip = gpiod_chip_open_lookup(line->chip);
    made->line = made->chip ? find(made->chip, line) : NULL;
    if (!made->chip)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no chip %s (%s)", text, line->chip, strerror(errno));
    else if (!made->line)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: the chip has no such line", text);
    else if ((line->role == LUMI_GPIO_ESTOP || line->role == LUMI_GPIO_SYNC
                  ? gpiod_line_request_both_edges_events_flags(made->line, LUMI_GPIO_CONSUMER, flags)
                  : gpiod_line_request_output_flags(made->line, LUMI_GPIO_CONSUMER, flags,
                                                    line->role == LUMI_GPIO_POWER)) < 0)
        code = errno == EBUSY ? lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it", text)
                              : lumi_fail(error, LUMI_ERR_IO, "%s: it cannot be had: %s", text, strerror(errno));
    if (code == LUMI_OK)
        *held = made;
    else {
        if (made->chip)
            gpiod_chip_close(made->chip);
        free(made);
    }
    return code;
}

void lumi_gpio_release(struct lumi_gpio_held *held)
{
    gpiod_line_release(held->line);
    gpiod_chip_close(held->chip);
    free(held);
}

int lumi_gpio_held_fd(struct lumi_gpio_held *held)
{
    return gpiod_line_event_get_fd(held->line);
}

int lumi_gpio_held_read(struct lumi_gpio_held *held, struct lumi_gpio_event *events, int max)
{
    struct gpiod_line_event read[16];
    int count = gpiod_line_event_read_multiple(held->line, read, max < 16 ? (unsigned)max : 16);

    if (count <= 0)
        return count < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : LUMI_ERR_IO;
    for (int i = 0; i < count; i++) {
        bool active = read[i].event_type == GPIOD_LINE_EVENT_RISING_EDGE;
        events[i] = (struct lumi_gpio_event){.active = active,
                                             .at_ns = (int64_t)read[i].ts.tv_sec * 1000000000 + read[i].ts.tv_nsec,
                                             .lost = held->known && held->active == active ? 1 : 0};
        held->known = true;
        held->active = active;
    }
    return count;
}

int lumi_gpio_held_get(struct lumi_gpio_held *held)
{
    return gpiod_line_get_value(held->line);
}

int lumi_gpio_held_set(struct lumi_gpio_held *held, bool active)
{
    return gpiod_line_set_value(held->line, active);
}

const char *lumi_gpio_library(void)
{
    static char text[64];

    snprintf(text, sizeof text, "libgpiod %s", gpiod_version_string());
    return text;
}
