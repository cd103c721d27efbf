/* daemon/gpio on the kernel's simulated chip (gpio-sim): every edge with its time, an emergency stop from its thread,
 * outputs, lines that cannot be had, a chip that goes away.
 * usage: gpio_chip LABEL FOLDER LIVE   (FOLDER: the device's in sysfs with gpiochipM/sim_gpioN/pull; LIVE: what takes
 * the chip away, which comes back with another M) */
#include "daemon/gpio/gpio.h"

#include <glob.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define EDGES 200
#define PATIENCE_MS 20000 /* an emulated machine has time */

static const char *folder;
static struct {
    pthread_mutex_t lock;
    int presses, releases;
    int64_t at_ns, told_ns;
} stop = {.lock = PTHREAD_MUTEX_INITIALIZER};

static int64_t now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void check(bool good, const char *what)
{
    printf("%s: %s\n", good ? "good" : "BAD", what);
    if (!good)
        exit(1);
}

static void put(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");

    if (!file || fputs(text, file) < 0 || fclose(file) != 0) {
        perror(path);
        exit(1);
    }
}

static void find(int line, const char *what, char *path, size_t size)
{
    glob_t found;

    snprintf(path, size, "%s/gpiochip*/sim_gpio%d/%s", folder, line, what);
    if (glob(path, 0, NULL, &found) == 0) {
        snprintf(path, size, "%s", found.gl_pathv[0]);
        globfree(&found);
    }
}

static void pull(int line, bool up)
{
    char path[512];

    find(line, "pull", path, sizeof path);
    put(path, up ? "pull-up" : "pull-down");
}

static int value(int line)
{
    char path[512], text[8] = "";

    find(line, "value", path, sizeof path);
    FILE *file = fopen(path, "r");
    if (file) {
        if (!fgets(text, sizeof text, file))
            text[0] = 0;
        fclose(file);
    }
    return atoi(text);
}

static void on_estop(void *context, bool pressed, int64_t at_ns)
{
    (void)context;
    pthread_mutex_lock(&stop.lock);
    stop.presses += pressed;
    stop.releases += !pressed;
    stop.at_ns = at_ns;
    stop.told_ns = now_ns();
    pthread_mutex_unlock(&stop.lock);
}

static bool await(const int *count, int wanted)
{
    for (int i = 0; i < PATIENCE_MS; i++) {
        pthread_mutex_lock(&stop.lock);
        bool done = *count >= wanted;
        pthread_mutex_unlock(&stop.lock);
        if (done)
            return true;
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    return false;
}

static bool await_high(int line)
{
    for (int i = 0; i < PATIENCE_MS; i++) {
        if (value(line) == 1)
            return true;
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    return false;
}

static bool await_edge(struct lumi_gpio *gpio, struct lumi_gpio_edge *edge)
{
    for (int i = 0; i < PATIENCE_MS; i++) {
        if (lumi_gpio_edge(gpio, edge))
            return true;
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
    return false;
}

/* One after another: the kernel's interrupt thread makes one of edges that come while it has not run yet. */
static void edges(struct lumi_gpio *gpio)
{
    struct lumi_gpio_edge edge;
    int64_t begin = now_ns();
    int seen = 0;
    bool right = true;

    while (seen < EDGES) {
        int64_t before = now_ns();
        pull(1, seen % 2 == 0);
        if (!await_edge(gpio, &edge))
            break;
        right = right && edge.line == 1 && edge.at_ns >= before && edge.at_ns <= now_ns() && edge.lost == 0 &&
                edge.active == (seen % 2 == 0);
        seen++;
    }
    printf("%d edges in %.1f ms\n", seen, (double)(now_ns() - begin) * 1e-6);
    check(seen == EDGES, "every edge is there");
    check(right, "in order, none told as lost, their times lie where they were made");
}

static void estop(struct lumi_gpio *gpio)
{
    struct lumi_gpio_edge edge;

    pull(0, false); /* active low */
    check(await(&stop.presses, 1), "the emergency stop is told");
    printf("told %.3f ms after its edge\n", (double)(stop.told_ns - stop.at_ns) * 1e-6);
    pull(0, true);
    check(await(&stop.releases, 1), "and its release");
    check(await_edge(gpio, &edge) && edge.line == 0 && edge.active && await_edge(gpio, &edge) && !edge.active,
          "its edges come in the queue as well");
}

static void refusals(const struct lumi_gpio_line *lines, const struct lumi_gpio_options *options)
{
    struct lumi_gpio_line other = lines[1];
    struct lumi_gpio *gpio = NULL;
    struct lumi_error error = {0};

    check(lumi_gpio_open(&other, 1, options, &gpio, &error) == LUMI_ERR_BUSY, error.text);
    strcpy(other.line_name, "NOBODY");
    check(lumi_gpio_open(&other, 1, options, &gpio, &error) == LUMI_ERR_NOTFOUND, error.text);
    other.offset = 4711;
    check(lumi_gpio_open(&other, 1, options, &gpio, &error) == LUMI_ERR_NOTFOUND, error.text);
    strcpy(other.chip, "nochip");
    check(lumi_gpio_open(&other, 1, options, &gpio, &error) == LUMI_ERR_NOTFOUND, error.text);
}

static void comes_back(struct lumi_gpio *gpio, const char *live)
{
    struct lumi_error error = {0};

    stop.presses = stop.releases = 0;
    put(live, "0");
    check(await(&stop.presses, 1), "an emergency stop whose chip is gone counts as pressed");
    check(lumi_gpio_set(gpio, 2, true, &error) != LUMI_OK, error.text);
    put(live, "1");
    pull(0, true); /* nobody holds a new chip's line up */
    check(await(&stop.releases, 1), "until the chip is back and nobody presses it");
    check(await_high(2), "an output is again as it was");
    pull(0, false);
    check(await(&stop.presses, 2), "and the next press is told");
}

int main(int argc, char **argv)
{
    struct lumi_gpio_line lines[] = {
        {.role = LUMI_GPIO_ESTOP, .offset = -1, .line_name = "ESTOP", .active_low = true, .debounce_us = 1000},
        {.role = LUMI_GPIO_SYNC, .offset = -1, .line_name = "EXPSYNC", .camera = "c00"},
        {.role = LUMI_GPIO_LAMP, .offset = 2}};
    const struct lumi_gpio_options options = {.estop = on_estop};
    struct lumi_error error = {0};
    struct lumi_gpio *gpio = NULL;
    bool active;

    if (argc != 4)
        return 2;
    folder = argv[2];
    for (int i = 0; i < 3; i++)
        snprintf(lines[i].chip, sizeof lines[i].chip, "%s", argv[1]);
    printf("%s\n", lumi_gpio_library());
    pull(0, true);
    check(lumi_gpio_open(lines, 3, &options, &gpio, &error) == LUMI_OK, "the lines are had by label and name");
    check(lumi_gpio_get(gpio, 0, &active, &error) == LUMI_OK && !active, "nobody presses the emergency stop");
    estop(gpio);
    edges(gpio);
    check(lumi_gpio_set(gpio, 2, true, &error) == LUMI_OK && value(2) == 1, "the lamp is switched on");
    refusals(lines, &options);
    lumi_gpio_close(gpio);
    check(value(2) == 0, "the lamp is off when it ends");
    stop.presses = 0;
    pull(0, false);
    check(lumi_gpio_open(lines, 3, &options, &gpio, &error) == LUMI_OK && await(&stop.presses, 1),
          "one that is pressed from the beginning is told");
    pull(0, true);
    check(await(&stop.releases, 2), "and released");
    check(lumi_gpio_set(gpio, 2, true, &error) == LUMI_OK, "the lamp is switched on");
    comes_back(gpio, argv[3]);
    lumi_gpio_close(gpio);
    return 0;
}
