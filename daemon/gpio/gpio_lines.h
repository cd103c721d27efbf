/* One line of a GPIO chip, by whichever libgpiod there is: gpio_lines_v1.c (1.6) or gpio_lines_v2.c (2.x); the build
 * takes one of them. Blocks nowhere but in the kernel's own calls. */
#ifndef LUMI_DAEMON_GPIO_GPIO_LINES_H
#define LUMI_DAEMON_GPIO_GPIO_LINES_H

#include "daemon/gpio/gpio.h"

#include <stddef.h>

#define LUMI_GPIO_CONSUMER "lumid" /* what the kernel says has the line */

struct lumi_gpio_held;
struct lumi_gpio_event {
    bool active;
    int64_t at_ns; /* CLOCK_MONOTONIC, by the kernel */
    uint32_t lost; /* before it, of this line */
};

/* ESTOP and SYNC: an input with both edges; LAMP and POWER: an output, inactive. */
int lumi_gpio_hold(const struct lumi_gpio_line *line, struct lumi_gpio_held **held, struct lumi_error *error);
void lumi_gpio_release(struct lumi_gpio_held *held);
int lumi_gpio_held_fd(struct lumi_gpio_held *held);
/* What its descriptor has; up to `max`. Returns how many, or a negative code: the line is gone. */
int lumi_gpio_held_read(struct lumi_gpio_held *held, struct lumi_gpio_event *events, int max);
/* −1: it cannot be read. */
int lumi_gpio_held_get(struct lumi_gpio_held *held);
int lumi_gpio_held_set(struct lumi_gpio_held *held, bool active); /* 0, or −1 with errno */

#endif
