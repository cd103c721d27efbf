/* The thread that waits for edges, and the queue they wait in.
 *
 * 1. An emergency stop is looked at before everything else that has come, and told in this thread.
 * 2. A line of an emergency stop that cannot be read any more (its chip is gone) counts as pressed, until the chip is
 * back and the line says otherwise. */
#include "daemon/gpio/gpio.h"

#include "daemon/gpio/gpio_lines.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#define QUEUE 4096 /* edges that wait to be taken; more are counted as lost */
#define PRIORITY 50
#define AGAIN_MS 500 /* how often a chip that is gone is looked for */

struct lumi_gpio {
    struct lumi_gpio_line lines[LUMI_GPIO_LINES];
    struct lumi_gpio_held *held[LUMI_GPIO_LINES];
    pthread_mutex_t holding; /* held and wanted, once the thread runs; it reads held of its inputs without */
    bool wanted[LUMI_GPIO_LINES];
    bool gone[LUMI_GPIO_LINES], pressed[LUMI_GPIO_LINES]; /* of the thread's own */
    int count, order[LUMI_GPIO_LINES], inputs;            /* emergency stops first */
    struct lumi_gpio_options options;
    pthread_t thread;
    bool running;
    int stop; /* eventfd */
    pthread_mutex_t lock;
    struct lumi_gpio_edge queue[QUEUE];
    int first, waiting;
    uint32_t lost[LUMI_GPIO_LINES];
};

void lumi_gpio_line_text(const struct lumi_gpio_line *line, char *text, size_t size)
{
    static const char *const roles[] = {"emergency stop", "exposure edges", "lamp", "power"};
    char place[80];

    if (line->offset < 0)
        snprintf(place, sizeof place, "%.63s", line->line_name);
    else
        snprintf(place, sizeof place, "%d", line->offset);
    snprintf(text, size, "GPIO %.63s:%s (%s%s%.31s)", line->chip, place, roles[line->role],
             line->camera[0] ? " of " : "", line->camera);
}

static int64_t now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* ---- the thread ---- */

static void press(struct lumi_gpio *gpio, int line, bool pressed, int64_t at_ns)
{
    if (gpio->pressed[line] == pressed)
        return;
    gpio->pressed[line] = pressed;
    if (gpio->options.estop)
        gpio->options.estop(gpio->options.context, pressed, at_ns);
}

static void keep(struct lumi_gpio *gpio, int line, const struct lumi_gpio_event *event)
{
    pthread_mutex_lock(&gpio->lock);
    gpio->lost[line] += event->lost;
    if (gpio->waiting == QUEUE)
        gpio->lost[line]++;
    else {
        gpio->queue[(gpio->first + gpio->waiting++) % QUEUE] = (struct lumi_gpio_edge){
            .line = line, .active = event->active, .at_ns = event->at_ns, .lost = gpio->lost[line]};
        gpio->lost[line] = 0;
    }
    pthread_mutex_unlock(&gpio->lock);
}

static bool take_line(struct lumi_gpio *gpio, int line)
{
    struct lumi_gpio_event events[16];
    bool estop = gpio->lines[line].role == LUMI_GPIO_ESTOP;
    int count = lumi_gpio_held_read(gpio->held[line], events, 16);

    if (count < 0) {
        gpio->gone[line] = true;
        if (estop)
            press(gpio, line, true, now_ns());
        if (gpio->options.gone)
            gpio->options.gone(gpio->options.context, line, true);
        return false;
    }
    for (int i = 0; i < count; i++) {
        if (estop)
            press(gpio, line, events[i].active, events[i].at_ns);
        keep(gpio, line, &events[i]);
    }
    /* What the kernel's queue dropped may have been the last edge: the line itself knows. */
    int value = estop && count > 0 ? lumi_gpio_held_get(gpio->held[line]) : -1;
    if (value >= 0)
        press(gpio, line, value > 0, now_ns());
    return count > 0;
}

static bool hold_again(struct lumi_gpio *gpio, int line)
{
    struct lumi_gpio_held *made;
    struct lumi_error error;

    if (lumi_gpio_hold(&gpio->lines[line], &made, &error) != LUMI_OK)
        return false;
    lumi_gpio_release(gpio->held[line]);
    gpio->held[line] = made;
    return true;
}

static bool is_output(const struct lumi_gpio_line *line)
{
    return line->role == LUMI_GPIO_LAMP || line->role == LUMI_GPIO_POWER;
}

/* An input's chip may be back, and its outputs with it, which a new chip has switched off. */
static void look_again(struct lumi_gpio *gpio, int line)
{
    pthread_mutex_lock(&gpio->holding);
    bool back = hold_again(gpio, line);
    for (int i = 0; i < gpio->count && back; i++)
        if (is_output(&gpio->lines[i]) && strcmp(gpio->lines[i].chip, gpio->lines[line].chip) == 0 &&
            hold_again(gpio, i))
            lumi_gpio_held_set(gpio->held[i], gpio->wanted[i]);
    pthread_mutex_unlock(&gpio->holding);
    if (!back)
        return;
    gpio->gone[line] = false;
    if (gpio->options.gone)
        gpio->options.gone(gpio->options.context, line, false);
    if (gpio->lines[line].role == LUMI_GPIO_ESTOP && lumi_gpio_held_get(gpio->held[line]) == 0)
        press(gpio, line, false, now_ns());
}

static int wait_for_edges(struct lumi_gpio *gpio, struct pollfd *fds)
{
    bool gone = false;

    for (int i = 0; i < gpio->inputs; i++) {
        int line = gpio->order[i];
        if (gpio->gone[line])
            look_again(gpio, line);
        gone = gone || gpio->gone[line];
        fds[i] = (struct pollfd){.fd = gpio->gone[line] ? -1 : lumi_gpio_held_fd(gpio->held[line]), .events = POLLIN};
    }
    fds[gpio->inputs] = (struct pollfd){.fd = gpio->stop, .events = POLLIN};
    return poll(fds, (nfds_t)gpio->inputs + 1, gone ? AGAIN_MS : -1);
}

static void *edges(void *context)
{
    struct lumi_gpio *gpio = context;
    struct pollfd fds[LUMI_GPIO_LINES + 1];

    for (int i = 0; i < gpio->inputs && gpio->lines[gpio->order[i]].role == LUMI_GPIO_ESTOP; i++)
        if (lumi_gpio_held_get(gpio->held[gpio->order[i]]) > 0)
            press(gpio, gpio->order[i], true, now_ns());
    for (;;) {
        bool any = false;
        if (wait_for_edges(gpio, fds) < 0 && errno != EINTR)
            break;
        if (fds[gpio->inputs].revents)
            break;
        for (int i = 0; i < gpio->inputs; i++)
            if (fds[i].revents)
                any = take_line(gpio, gpio->order[i]) || any;
        if (any && gpio->options.wake)
            gpio->options.wake(gpio->options.context);
    }
    return NULL;
}

/* ---- life ---- */

static int start(struct lumi_gpio *gpio, struct lumi_error *error)
{
    const struct sched_param urgent = {.sched_priority = PRIORITY};

    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < gpio->count; i++)
            if (gpio->lines[i].role == (pass == 0 ? LUMI_GPIO_ESTOP : LUMI_GPIO_SYNC))
                gpio->order[gpio->inputs++] = i;
    if (gpio->inputs == 0)
        return LUMI_OK;
    gpio->stop = eventfd(0, EFD_CLOEXEC);
    if (gpio->stop < 0)
        return lumi_fail_errno(error, "GPIO", "making an eventfd");
    if (pthread_create(&gpio->thread, NULL, edges, gpio) != 0)
        return lumi_fail(error, LUMI_ERR_NOMEM, "GPIO: no thread can be started");
    gpio->running = true;
    pthread_setschedparam(gpio->thread, SCHED_FIFO, &urgent); /* where that is allowed */
    return LUMI_OK;
}

int lumi_gpio_open(const struct lumi_gpio_line *lines, int count, const struct lumi_gpio_options *options,
                   struct lumi_gpio **gpio, struct lumi_error *error)
{
    struct lumi_gpio *made = count >= 0 && count <= LUMI_GPIO_LINES ? calloc(1, sizeof *made) : NULL;
    int code = LUMI_OK;

    if (!made)
        return lumi_fail(error, count > LUMI_GPIO_LINES ? LUMI_ERR_ARG : LUMI_ERR_NOMEM, "GPIO: %d lines", count);
    made->options = *options;
    made->stop = -1;
    pthread_mutex_init(&made->lock, NULL);
    pthread_mutex_init(&made->holding, NULL);
    for (int i = 0; i < count && code == LUMI_OK; i++) {
        made->lines[i] = lines[i];
        made->wanted[i] = lines[i].role == LUMI_GPIO_POWER;
        code = lumi_gpio_hold(&lines[i], &made->held[i], error);
        made->count += code == LUMI_OK;
    }
    if (code == LUMI_OK)
        code = start(made, error);
    if (code == LUMI_OK)
        *gpio = made;
    else
        lumi_gpio_close(made);
    return code;
}

void lumi_gpio_close(struct lumi_gpio *gpio)
{
    uint64_t one = 1;

    if (!gpio)
        return;
    if (gpio->running && write(gpio->stop, &one, sizeof one) == sizeof one)
        pthread_join(gpio->thread, NULL);
    for (int i = 0; i < gpio->count; i++) {
        if (is_output(&gpio->lines[i]))
            lumi_gpio_held_set(gpio->held[i], false);
        lumi_gpio_release(gpio->held[i]);
    }
    if (gpio->stop >= 0)
        close(gpio->stop);
    pthread_mutex_destroy(&gpio->lock);
    pthread_mutex_destroy(&gpio->holding);
    free(gpio);
}

bool lumi_gpio_edge(struct lumi_gpio *gpio, struct lumi_gpio_edge *edge)
{
    pthread_mutex_lock(&gpio->lock);
    bool any = gpio->waiting > 0;
    if (any) {
        *edge = gpio->queue[gpio->first];
        gpio->first = (gpio->first + 1) % QUEUE;
        gpio->waiting--;
    }
    pthread_mutex_unlock(&gpio->lock);
    return any;
}

int lumi_gpio_set(struct lumi_gpio *gpio, int line, bool active, struct lumi_error *error)
{
    char text[160];

    pthread_mutex_lock(&gpio->holding);
    gpio->wanted[line] = active;
    bool set = lumi_gpio_held_set(gpio->held[line], active) == 0;
    int saved = errno;
    if (!set && hold_again(gpio, line)) /* its chip was gone, and is back */
        set = lumi_gpio_held_set(gpio->held[line], active) == 0;
    pthread_mutex_unlock(&gpio->holding);
    if (set)
        return LUMI_OK;
    lumi_gpio_line_text(&gpio->lines[line], text, sizeof text);
    return lumi_fail(error, LUMI_ERR_IO, "%s: it cannot be set: %s", text, strerror(saved));
}

int lumi_gpio_get(struct lumi_gpio *gpio, int line, bool *active, struct lumi_error *error)
{
    char text[160];

    pthread_mutex_lock(&gpio->holding);
    int value = lumi_gpio_held_get(gpio->held[line]);
    pthread_mutex_unlock(&gpio->holding);
    if (value >= 0) {
        *active = value > 0;
        return LUMI_OK;
    }
    lumi_gpio_line_text(&gpio->lines[line], text, sizeof text);
    return lumi_fail(error, LUMI_ERR_IO, "%s: it cannot be read: %s", text, strerror(errno));
}
