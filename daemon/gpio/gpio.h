/* GPIO lines of the host, by libgpiod 1.6 or 2: e-stop, exposure-sync edges with the kernel's time, status lamp, power
 * of the cameras. A thread of its own waits for edges; an e-stop goes from that thread straight to the link, with
 * nothing in between. */
#ifndef LUMI_DAEMON_GPIO_GPIO_H
#define LUMI_DAEMON_GPIO_GPIO_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_GPIO_LINES 32
#define LUMI_GPIO_NAME 32

enum lumi_gpio_role { LUMI_GPIO_ESTOP = 0, LUMI_GPIO_SYNC, LUMI_GPIO_LAMP, LUMI_GPIO_POWER };
struct lumi_gpio_line {
    enum lumi_gpio_role role;
    char chip[64]; /* "gpiochip0" or its label */
    int offset;    /* −1: `line_name` */
    char line_name[64];
    char camera[LUMI_GPIO_NAME]; /* SYNC, POWER: whose; "" all */
    bool active_low;
    int debounce_us; /* ESTOP, by the kernel: libgpiod 2 only; 0 none */
};

struct lumi_gpio_edge {
    int line; /* index into the lines given */
    bool active;
    int64_t at_ns; /* CLOCK_MONOTONIC, by the kernel */
    uint32_t lost; /* edges of this line that the kernel's queue dropped before it, as its numbers say */
};

struct lumi_gpio;
struct lumi_gpio_options {
    void (*estop)(void *context, bool pressed, int64_t at_ns); /* in the edge thread: at once */
    void (*wake)(void *context);                               /* edges wait to be taken */
    void (*gone)(void *context, int line, bool gone);          /* an input's chip, in the edge thread; NULL: not told */
    void *context;
};
/* Asks for the lines. LUMI_ERR_NOTFOUND (no such chip or line), LUMI_ERR_BUSY (somebody's), each naming the line. An
 * e-stop that is pressed already is reported at once; one whose chip goes away counts as pressed. A chip that comes
 * back is taken again, outputs as they were; then an e-stop is what its line says. Edges in between are not told. Power
 * is on from here on, a lamp off. */
int lumi_gpio_open(const struct lumi_gpio_line *lines, int count, const struct lumi_gpio_options *options,
                   struct lumi_gpio **gpio, struct lumi_error *error);
void lumi_gpio_close(struct lumi_gpio *gpio);                             /* outputs go inactive; NULL is fine */
bool lumi_gpio_edge(struct lumi_gpio *gpio, struct lumi_gpio_edge *edge); /* the next; false: none */
int lumi_gpio_set(struct lumi_gpio *gpio, int line, bool active, struct lumi_error *error);
/* Of an input; reads it. */
int lumi_gpio_get(struct lumi_gpio *gpio, int line, bool *active, struct lumi_error *error);
/* "GPIO gpiochip0:5 (emergency stop)", for messages. */
void lumi_gpio_line_text(const struct lumi_gpio_line *line, char *text, size_t size);
/* "libgpiod 2.2.1" */
const char *lumi_gpio_library(void);

#endif
