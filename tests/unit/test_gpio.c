/* daemon/gpio: libgpiod itself, 1.6 or 2, on a chip whose kernel side is here: the folders and the node are umockdev's,
 * the ioctls are answered below, for both of the kernel's interfaces, and a line's descriptor is one end of a socket
 * pair. Run under umockdev-wrapper. */
#include "daemon/gpio/gpio.h"

#include <dlfcn.h>
#include <errno.h>
#include <linux/gpio.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <umockdev.h>
#include <unistd.h>

#include <cmocka.h>

#define LINES 8

/* The chip. A line's `near` end is the library's, `far` the kernel's. */
static struct line {
    bool held, output, active_low, two; /* two: the second interface */
    int near, far;
    bool value; /* logical, as the library sees it */
    uint32_t number;
    uint64_t debounce;
} lines[LINES];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int hold(uint32_t offset, bool two, int *fd)
{
    int ends[2];

    if (offset >= LINES) {
        errno = EINVAL;
        return -1;
    }
    if (lines[offset].held) {
        errno = EBUSY;
        return -1;
    }
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return -1;
    lines[offset].held = true;
    lines[offset].two = two;
    lines[offset].near = *fd = ends[0];
    lines[offset].far = ends[1];
    lines[offset].number = 0;
    return 0;
}

static struct line *line_of(int fd)
{
    for (int i = 0; i < LINES; i++)
        if (lines[i].held && lines[i].near == fd)
            return &lines[i];
    abort();
}

static int answer_first(int fd, unsigned long request, void *argument)
{
    struct gpioevent_request *events = argument;
    struct gpiohandle_request *handles = argument;
    struct gpiohandle_data *data = argument;
    struct gpioline_info *info = argument;

    switch (request) {
    case GPIO_GET_LINEINFO_IOCTL:
        if (info->line_offset >= LINES) {
            errno = EINVAL;
            return -1;
        }
        snprintf(info->name, sizeof info->name, "%s", info->line_offset == 3 ? "stop" : "");
        info->flags = lines[info->line_offset].held ? GPIOLINE_FLAG_KERNEL : 0;
        return 0;
    case GPIO_GET_LINEEVENT_IOCTL:
        if (events->eventflags != GPIOEVENT_REQUEST_BOTH_EDGES || hold(events->lineoffset, false, &events->fd) != 0)
            return -1;
        lines[events->lineoffset].active_low = events->handleflags & GPIOHANDLE_REQUEST_ACTIVE_LOW;
        lines[events->lineoffset].output = false;
        return 0;
    case GPIO_GET_LINEHANDLE_IOCTL:
        if (hold(handles->lineoffsets[0], false, &handles->fd) != 0)
            return -1;
        lines[handles->lineoffsets[0]].output = handles->flags & GPIOHANDLE_REQUEST_OUTPUT;
        lines[handles->lineoffsets[0]].value = handles->default_values[0];
        return 0;
    case GPIOHANDLE_GET_LINE_VALUES_IOCTL:
        data->values[0] = line_of(fd)->value;
        return 0;
    case GPIOHANDLE_SET_LINE_VALUES_IOCTL:
        line_of(fd)->value = data->values[0];
        return 0;
    default:
        errno = ENOTTY;
        return -1;
    }
}

static int answer_second(int fd, unsigned long request, void *argument)
{
    struct gpio_v2_line_request *asked = argument;
    struct gpio_v2_line_values *values = argument;
    struct gpio_v2_line_info *info = argument;

    switch (request) {
    case GPIO_V2_GET_LINEINFO_IOCTL:
        if (info->offset >= LINES) {
            errno = EINVAL;
            return -1;
        }
        snprintf(info->name, sizeof info->name, "%s", info->offset == 3 ? "stop" : "");
        return 0;
    case GPIO_V2_GET_LINE_IOCTL:
        if (hold(asked->offsets[0], true, &asked->fd) != 0)
            return -1;
        lines[asked->offsets[0]].active_low = asked->config.flags & GPIO_V2_LINE_FLAG_ACTIVE_LOW;
        lines[asked->offsets[0]].output = asked->config.flags & GPIO_V2_LINE_FLAG_OUTPUT;
        for (uint32_t i = 0; i < asked->config.num_attrs; i++)
            if (asked->config.attrs[i].attr.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES)
                lines[asked->offsets[0]].value = asked->config.attrs[i].attr.values & 1;
            else if (asked->config.attrs[i].attr.id == GPIO_V2_LINE_ATTR_ID_DEBOUNCE)
                lines[asked->offsets[0]].debounce = asked->config.attrs[i].attr.debounce_period_us;
        return 0;
    case GPIO_V2_LINE_GET_VALUES_IOCTL:
        values->bits = line_of(fd)->value;
        return 0;
    case GPIO_V2_LINE_SET_VALUES_IOCTL:
        line_of(fd)->value = values->bits & 1;
        return 0;
    default:
        errno = ENOTTY;
        return -1;
    }
}

/* In place of the C library's, for everything this program calls. */
int ioctl(int fd, unsigned long request, ...)
{
    static int (*next)(int, unsigned long, ...);
    va_list list;

    va_start(list, request);
    void *argument = va_arg(list, void *);
    va_end(list);
    request &= 0xffffffff; /* some keep it in an int */
    if (((request >> 8) & 0xff) != 0xB4) {
        if (!next)
            *(void **)&next = dlsym(RTLD_NEXT, "ioctl");
        return next(fd, request, argument);
    }
    pthread_mutex_lock(&lock);
    int result;
    if (request == GPIO_GET_CHIPINFO_IOCTL) {
        *(struct gpiochip_info *)argument =
            (struct gpiochip_info){.name = "gpiochip0", .label = "bench", .lines = LINES};
        result = 0;
    } else if ((request & 0xff) >= 5 && (request & 0xff) != 8 && (request & 0xff) != 9)
        result = answer_second(fd, request, argument);
    else
        result = answer_first(fd, request, argument);
    pthread_mutex_unlock(&lock);
    return result;
}

static int64_t now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* The line goes up or down. `told` false: the kernel's queue is full. */
static void edge(int offset, bool active, int64_t at_ns, bool told)
{
    struct line *line = &lines[offset];

    pthread_mutex_lock(&lock);
    line->value = active;
    line->number++;
    if (told && line->two) {
        struct gpio_v2_line_event event = {.timestamp_ns = (uint64_t)at_ns,
                                           .id = active ? GPIO_V2_LINE_EVENT_RISING_EDGE
                                                        : GPIO_V2_LINE_EVENT_FALLING_EDGE,
                                           .offset = (uint32_t)offset,
                                           .seqno = line->number,
                                           .line_seqno = line->number};
        assert_int_equal(write(line->far, &event, sizeof event), sizeof event);
    } else if (told) {
        struct gpioevent_data event = {(uint64_t)at_ns,
                                       active ? GPIOEVENT_EVENT_RISING_EDGE : GPIOEVENT_EVENT_FALLING_EDGE};
        assert_int_equal(write(line->far, &event, sizeof event), sizeof event);
    }
    pthread_mutex_unlock(&lock);
}

/* The chip goes and nobody can have the line; a new one comes, with everything off. */
static void unplug(int offset)
{
    pthread_mutex_lock(&lock);
    close(lines[offset].far);
    lines[offset].far = -1;
    pthread_mutex_unlock(&lock);
}

static void plug(int offset)
{
    pthread_mutex_lock(&lock);
    lines[offset].held = lines[offset].value = false;
    pthread_mutex_unlock(&lock);
}

/* ---- who listens ---- */

static struct heard {
    pthread_mutex_t lock;
    pthread_cond_t changed;
    int presses, releases, wakes;
    pthread_t thread;
} heard = {.lock = PTHREAD_MUTEX_INITIALIZER, .changed = PTHREAD_COND_INITIALIZER};

static void on_estop(void *context, bool pressed, int64_t at_ns)
{
    (void)context;
    (void)at_ns;
    pthread_mutex_lock(&heard.lock);
    heard.presses += pressed;
    heard.releases += !pressed;
    heard.thread = pthread_self();
    pthread_cond_broadcast(&heard.changed);
    pthread_mutex_unlock(&heard.lock);
}

static void on_wake(void *context)
{
    (void)context;
    pthread_mutex_lock(&heard.lock);
    heard.wakes++;
    pthread_cond_broadcast(&heard.changed);
    pthread_mutex_unlock(&heard.lock);
}

/* Until it is so; a test that waits for ever is ended from outside. */
static void await(const int *count, int value)
{
    pthread_mutex_lock(&heard.lock);
    while (*count < value)
        pthread_cond_wait(&heard.changed, &heard.lock);
    pthread_mutex_unlock(&heard.lock);
}

static void await_edge(struct lumi_gpio *gpio, struct lumi_gpio_edge *found)
{
    while (!lumi_gpio_edge(gpio, found))
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
}

static const struct lumi_gpio_options options = {.estop = on_estop, .wake = on_wake};
static const struct lumi_gpio_line estop = {
    .role = LUMI_GPIO_ESTOP, .chip = "gpiochip0", .offset = -1, .line_name = "stop"};
static const struct lumi_gpio_line sync_line = {
    .role = LUMI_GPIO_SYNC, .chip = "gpiochip0", .offset = 5, .camera = "c00"};
static const struct lumi_gpio_line lamp = {.role = LUMI_GPIO_LAMP, .chip = "gpiochip0", .offset = 6};
static UMockdevTestbed *bed;

static int set_up(void **state)
{
    GError *error = NULL;

    (void)state;
    for (int i = 0; i < LINES; i++)
        lines[i] = (struct line){.near = -1, .far = -1};
    heard.presses = heard.releases = heard.wakes = 0;
    bed = umockdev_testbed_new();
    if (!umockdev_testbed_add_from_string(
            bed,
            "P: /devices/platform/bench/gpiochip0\nN: gpiochip0\nE: DEVNAME=/dev/gpiochip0\n"
            "E: SUBSYSTEM=gpio\nE: MAJOR=254\nE: MINOR=0\nA: dev=254:0\\n\n",
            &error))
        fail_msg("%s", error->message);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    for (int i = 0; i < LINES; i++)
        if (lines[i].far >= 0)
            close(lines[i].far);
    g_object_unref(bed);
    return 0;
}

static struct lumi_gpio *open_lines(const struct lumi_gpio_line *wanted, int count)
{
    struct lumi_error error = {0};
    struct lumi_gpio *gpio = NULL;

    if (lumi_gpio_open(wanted, count, &options, &gpio, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return gpio;
}

/* ---- tests ---- */

static void an_edge_comes_with_the_kernels_time(void **state)
{
    struct lumi_gpio *gpio = open_lines(&sync_line, 1);
    struct lumi_gpio_edge found;

    (void)state;
    assert_false(lumi_gpio_edge(gpio, &found));
    edge(5, true, 123456789012, true);
    await(&heard.wakes, 1);
    await_edge(gpio, &found);
    assert_int_equal(found.line, 0);
    assert_true(found.active);
    assert_int_equal(found.at_ns, 123456789012);
    assert_int_equal(found.lost, 0);
    lumi_gpio_close(gpio);
}

static void edges_that_the_kernel_dropped_are_counted(void **state)
{
    struct lumi_gpio *gpio = open_lines(&sync_line, 1);
    struct lumi_gpio_edge found;

    (void)state;
    edge(5, true, 1000, true);
    await_edge(gpio, &found);
    edge(5, false, 2000, false);
    edge(5, true, 3000, true);
    await_edge(gpio, &found);
    assert_int_equal(found.at_ns, 3000);
    assert_int_equal(found.lost, 1);
    lumi_gpio_close(gpio);
}

static void a_thousand_edges_all_come_in_order(void **state)
{
    struct lumi_gpio *gpio = open_lines(&sync_line, 1);
    struct lumi_gpio_edge found;

    (void)state;
    for (int i = 0; i < 1000; i++)
        edge(5, i % 2 == 0, i, true);
    for (int i = 0; i < 1000; i++) {
        await_edge(gpio, &found);
        assert_int_equal(found.at_ns, i);
        assert_int_equal(found.lost, 0);
        assert_int_equal(found.active, i % 2 == 0);
    }
    lumi_gpio_close(gpio);
}

static void an_emergency_stop_is_told_in_the_edge_thread(void **state)
{
    const struct lumi_gpio_line both[] = {sync_line, estop};
    struct lumi_gpio *gpio = open_lines(both, 2);

    (void)state;
    edge(3, true, now_ns(), true);
    await(&heard.presses, 1);
    assert_false(pthread_equal(heard.thread, pthread_self()));
    edge(3, false, now_ns(), true);
    await(&heard.releases, 1);
    lumi_gpio_close(gpio);
    assert_int_equal(heard.presses, 1);
}

static void one_that_is_pressed_already_is_told_at_once(void **state)
{
    (void)state;
    lines[3].value = true;
    struct lumi_gpio *gpio = open_lines(&estop, 1);
    await(&heard.presses, 1);
    lumi_gpio_close(gpio);
}

/* The last edge is lost in the kernel's queue: the line's value says that it is pressed still. */
static void what_the_line_says_counts_where_edges_are_lost(void **state)
{
    struct lumi_gpio *gpio = open_lines(&estop, 1);

    (void)state;
    pthread_mutex_lock(&lock); /* the value is read when this is over */
    struct line *line = &lines[3];
    pthread_mutex_unlock(&lock);
    edge(3, true, now_ns(), true);
    await(&heard.presses, 1);
    edge(3, false, now_ns(), false);
    edge(3, true, now_ns(), true);
    edge(3, false, now_ns(), false);
    assert_false(line->value);
    edge(3, true, now_ns(), true);
    edge(3, false, now_ns(), true);
    await(&heard.releases, 1);
    lumi_gpio_close(gpio);
}

static void an_emergency_stop_whose_chip_goes_away_counts_as_pressed(void **state)
{
    struct lumi_gpio *gpio = open_lines(&estop, 1);

    (void)state;
    unplug(3);
    await(&heard.presses, 1);
    lumi_gpio_close(gpio);
}

static void a_chip_that_comes_back_is_taken_again_and_its_outputs_are_as_they_were(void **state)
{
    const struct lumi_gpio_line both[] = {lamp, estop};
    struct lumi_gpio *gpio = open_lines(both, 2);
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_gpio_set(gpio, 0, true, &error), LUMI_OK);
    unplug(3);
    await(&heard.presses, 1);
    assert_int_equal(heard.releases, 0);
    plug(6);
    plug(3);
    await(&heard.releases, 1);
    assert_true(lines[6].held && lines[6].value);
    edge(3, true, now_ns(), true);
    await(&heard.presses, 2);
    lumi_gpio_close(gpio);
}

static void outputs_are_switched_and_left_inactive(void **state)
{
    const struct lumi_gpio_line both[] = {lamp, estop};
    struct lumi_gpio *gpio = open_lines(both, 2);
    struct lumi_error error = {0};
    bool active = true;

    (void)state;
    assert_true(lines[6].output && !lines[6].value && !lines[3].output);
    assert_int_equal(lumi_gpio_set(gpio, 0, true, &error), LUMI_OK);
    assert_true(lines[6].value);
    assert_int_equal(lumi_gpio_get(gpio, 1, &active, &error), LUMI_OK);
    assert_false(active);
    lumi_gpio_close(gpio);
    assert_false(lines[6].value);
}

static void power_is_on_as_long_as_the_line_is_held(void **state)
{
    const struct lumi_gpio_line both[] = {{.role = LUMI_GPIO_POWER, .chip = "gpiochip0", .offset = 7}, estop};
    struct lumi_gpio *gpio = open_lines(both, 2);

    (void)state;
    assert_true(lines[7].output && lines[7].value);
    unplug(3);
    await(&heard.presses, 1);
    plug(7);
    plug(3);
    await(&heard.releases, 1);
    assert_true(lines[7].held && lines[7].value);
    lumi_gpio_close(gpio);
    assert_false(lines[7].value);
}

static void polarity_and_debouncing_are_asked_of_the_kernel(void **state)
{
    struct lumi_gpio_line line = estop;

    (void)state;
    line.active_low = true;
    line.debounce_us = 700;
    struct lumi_gpio *gpio = open_lines(&line, 1);
    assert_true(lines[3].active_low);
    if (lines[3].two)
        assert_int_equal(lines[3].debounce, 700);
    lumi_gpio_close(gpio);
}

/* libgpiod 1.6 looks for labels in a way that umockdev does not see. */
static void a_chip_is_found_by_its_label(void **state)
{
    struct lumi_gpio_line line = lamp;

    (void)state;
    if (strncmp(lumi_gpio_library(), "libgpiod 1", 10) == 0)
        skip();
    strcpy(line.chip, "bench");
    lumi_gpio_close(open_lines(&line, 1));
}

static void refused(const struct lumi_gpio_line *line, int code, const char *text)
{
    const struct lumi_gpio_line two[] = {lamp, *line};
    struct lumi_error error = {0};
    struct lumi_gpio *gpio = NULL;

    assert_int_equal(lumi_gpio_open(two, 2, &options, &gpio, &error), code);
    assert_null(gpio);
    if (!strstr(error.text, text))
        fail_msg("%s", error.text);
}

static void a_line_that_cannot_be_had_is_named(void **state)
{
    struct lumi_gpio_line line = sync_line;

    (void)state;
    strcpy(line.chip, "gpiochip7");
    refused(&line, LUMI_ERR_NOTFOUND, "GPIO gpiochip7:5 (exposure edges of c00): there is no chip gpiochip7");
    lines[6].held = false;
    line = sync_line;
    line.offset = LINES;
    refused(&line, LUMI_ERR_NOTFOUND, "GPIO gpiochip0:8 (exposure edges of c00): the chip has no such line");
    lines[6].held = false;
    line = estop;
    strcpy(line.line_name, "stopp");
    refused(&line, LUMI_ERR_NOTFOUND, "GPIO gpiochip0:stopp (emergency stop): the chip has no such line");
    lines[6].held = false;
    lines[5].held = true;
    refused(&sync_line, LUMI_ERR_BUSY, "GPIO gpiochip0:5 (exposure edges of c00): another program has it");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(an_edge_comes_with_the_kernels_time),
        TEST(edges_that_the_kernel_dropped_are_counted),
        TEST(a_thousand_edges_all_come_in_order),
        TEST(an_emergency_stop_is_told_in_the_edge_thread),
        TEST(one_that_is_pressed_already_is_told_at_once),
        TEST(what_the_line_says_counts_where_edges_are_lost),
        TEST(an_emergency_stop_whose_chip_goes_away_counts_as_pressed),
        TEST(a_chip_that_comes_back_is_taken_again_and_its_outputs_are_as_they_were),
        TEST(outputs_are_switched_and_left_inactive),
        TEST(power_is_on_as_long_as_the_line_is_held),
        TEST(polarity_and_debouncing_are_asked_of_the_kernel),
        TEST(a_chip_is_found_by_its_label),
        TEST(a_line_that_cannot_be_had_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
