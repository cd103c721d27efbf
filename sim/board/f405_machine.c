/* The board in its rig: pins to mechanics and back. */
#include "sim/board/f405_machine.h"

#include "firmware/stm32f405/pins.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <string.h>

#define SERIAL 2 /* USART2 */

struct f405_machine {
    struct f405 *chip;
    struct sim_mechanics *mechanics;
    struct usb_host *usb;
    GArray *steps, *triggers; /* struct f405_machine_edge */
    GByteArray *sent;         /* on the serial line, by the board */
    uint16_t lines;
    uint64_t mechanics_next; /* as it was when nothing had happened to them since; 0: to be asked */
};

/* ---- from the chip ---- */

static void step_edge(struct f405_machine *m, uint64_t at)
{
    bool forward = f405_output(m->chip, F405_PIN('A', PIN_A_DIR)) == F405_HIGH;
    struct f405_machine_edge edge = {at, forward};
    g_array_append_val(m->steps, edge);
    m->mechanics_next = 0;
    sim_mechanics_step(m->mechanics, at / 2, forward);
}

static void trigger_edge(struct f405_machine *m, int line, bool level, uint64_t at)
{
    uint16_t lines = (uint16_t)((m->lines & ~(1u << line)) | (unsigned)level << line);
    if (lines == m->lines)
        return;
    m->lines = lines;
    /* Lines of one write come one after another, at one time. */
    struct f405_machine_edge edge = {at, lines};
    struct f405_machine_edge *last =
        m->triggers->len ? &g_array_index(m->triggers, struct f405_machine_edge, m->triggers->len - 1) : NULL;
    if (last && last->at == at)
        last->lines = lines;
    else
        g_array_append_val(m->triggers, edge);
    m->mechanics_next = 0;
    sim_mechanics_trigger_lines(m->mechanics, at / 2, lines);
}

static void pin_changed(void *context, int pin, enum f405_level level, uint64_t at)
{
    struct f405_machine *m = context;
    bool high = level == F405_HIGH;
    m->mechanics_next = 0;
    if (pin >= F405_PIN('B', 0) && pin <= F405_PIN('B', 15)) {
        trigger_edge(m, pin - F405_PIN('B', 0), high, at);
        return;
    }
    switch (pin) {
    case F405_PIN('A', PIN_A_STEP):
        if (high)
            step_edge(m, at);
        break;
    case F405_PIN('A', PIN_A_ENABLE): /* left alone, the driver holds */
        sim_mechanics_output(m->mechanics, at / 2, BOARD_OUT_ENABLE, !high);
        break;
    case F405_PIN('A', PIN_A_BRAKE):
        sim_mechanics_output(m->mechanics, at / 2, BOARD_OUT_BRAKE, high);
        break;
    case F405_PIN('A', PIN_A_LAMP):
        sim_mechanics_output(m->mechanics, at / 2, BOARD_OUT_LAMP, high);
        break;
    case F405_PIN('C', PIN_C_STATUS):
        sim_mechanics_output(m->mechanics, at / 2, BOARD_OUT_STATUS, high);
        break;
    default:
        break;
    }
}

static void uart_out(void *context, int usart, uint8_t byte, uint64_t at)
{
    struct f405_machine *m = context;
    (void)at;
    if (usart == SERIAL)
        g_byte_array_append(m->sent, &byte, 1);
}

static int adc(void *context, int channel)
{
    struct f405_machine *m = context;
    if (channel != PIN_A_SUPPLY)
        return 0;
    int64_t value = (int64_t)sim_mechanics_supply_mv(m->mechanics) * 4096 / (SUPPLY_DIVIDER * SUPPLY_REFERENCE_MV);
    return value > 4095 ? 4095 : (int)value;
}

/* ---- to the chip ---- */

static void drive_input(void *context, enum board_input input, bool active, uint64_t at)
{
    static const uint8_t bit[BOARD_INPUTS] = {PIN_C_ESTOP, PIN_C_INDEX,        PIN_C_SLACK,  PIN_C_STRING_END,
                                              PIN_C_WOUND, PIN_C_DRIVER_FAULT, PIN_C_REACHED};
    struct f405_machine *m = context;
    (void)at;
    bool high = input == BOARD_IN_REACHED ? !active : active;
    f405_drive(m->chip, F405_PIN('C', bit[input]), high ? F405_HIGH : F405_LOW);
}

static void drive_feedback(void *context, int input, bool active, uint64_t at)
{
    struct f405_machine *m = context;
    (void)at;
    if (input >= 0 && input < 4)
        f405_drive(m->chip, F405_PIN('C', PIN_C_FEEDBACK0 + input), active ? F405_LOW : F405_HIGH);
}

static uint64_t outside_next(void *context)
{
    struct f405_machine *m = context;
    if (!m->mechanics_next) {
        uint64_t ticks = sim_mechanics_next(m->mechanics);
        m->mechanics_next = ticks >= BOARD_NEVER / 2 ? F405_NEVER : ticks * 2;
    }
    uint64_t next = m->mechanics_next;
    uint64_t usb = usb_host_next(m->usb);
    return usb < next ? usb : next;
}

static void outside_event(void *context, uint64_t now)
{
    struct f405_machine *m = context;
    const struct sim_mechanics_listener listener = {m, drive_input, drive_feedback};
    sim_mechanics_advance(m->mechanics, now / 2, &listener);
    m->mechanics_next = 0; /* after it, too: whoever was told may have asked in between */
    if (usb_host_next(m->usb) <= now)
        usb_host_event(m->usb, now);
}

static const struct f405_ops ops = {pin_changed, outside_next, outside_event, uart_out, adc};

/* ---- the machine ---- */

struct f405_machine *f405_machine_create(const struct lumi_rig *truth, const struct sim_mechanics_options *options)
{
    struct f405_machine *m = lumi_calloc(1, sizeof *m);
    if (!m)
        return NULL;
    m->steps = g_array_new(FALSE, FALSE, sizeof(struct f405_machine_edge));
    m->triggers = g_array_new(FALSE, FALSE, sizeof(struct f405_machine_edge));
    m->sent = g_byte_array_new();
    m->mechanics = sim_mechanics_create(truth, options);
    m->chip = f405_create(&ops, m);
    m->usb = m->chip ? usb_host_create(m->chip) : NULL;
    if (!m->mechanics || !m->usb) {
        f405_machine_destroy(m);
        return NULL;
    }
    for (int i = 0; i < BOARD_INPUTS; i++)
        drive_input(m, (enum board_input)i, sim_mechanics_input(m->mechanics, (enum board_input)i), 0);
    for (int i = 0; i < 4; i++)
        drive_feedback(m, i, sim_mechanics_feedback(m->mechanics, i), 0);
    return m;
}

void f405_machine_destroy(struct f405_machine *m)
{
    if (!m)
        return;
    usb_host_destroy(m->usb);
    f405_destroy(m->chip);
    sim_mechanics_destroy(m->mechanics);
    g_array_free(m->steps, TRUE);
    g_array_free(m->triggers, TRUE);
    g_byte_array_free(m->sent, TRUE);
    lumi_free(m);
}

int f405_machine_flash(struct f405_machine *m, const char *path, struct lumi_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0;
    LUMI_TRY(lumi_file_read(path, F405_FLASH_SIZE, &data, &size, error));
    bool fits = f405_flash_load(m->chip, F405_FLASH, data, size);
    lumi_free(data);
    return fits ? LUMI_OK : lumi_fail(error, LUMI_ERR_LIMIT, "%s: larger than the flash", path);
}

struct f405 *f405_machine_chip(struct f405_machine *m)
{
    return m->chip;
}

struct sim_mechanics *f405_machine_mechanics(struct f405_machine *m)
{
    return m->mechanics;
}

struct usb_host *f405_machine_usb(struct f405_machine *m)
{
    return m->usb;
}

uint64_t f405_machine_now(const struct f405_machine *m)
{
    return f405_now(m->chip);
}

enum f405_stop f405_machine_run_to(struct f405_machine *m, uint64_t cycle)
{
    enum f405_stop stop = F405_STOP_TIME;
    m->mechanics_next = 0; /* the caller may have done something to them */
    while (stop == F405_STOP_TIME && f405_now(m->chip) < cycle)
        stop = f405_run(m->chip, cycle);
    outside_event(m, f405_now(m->chip)); /* what the caller does to the mechanics now, it does at this time */
    return stop;
}

enum f405_stop f405_machine_run(struct f405_machine *m, double seconds)
{
    return f405_machine_run_to(m, f405_now(m->chip) + (uint64_t)(seconds * F405_HZ));
}

void f405_machine_power(struct f405_machine *m, bool on)
{
    f405_power(m->chip, on);
}

void f405_machine_power_cut_in_flash(struct f405_machine *m, unsigned operation)
{
    f405_cut_in_flash(m->chip, operation);
}

size_t f405_machine_serial_read(struct f405_machine *m, uint8_t *data, size_t size)
{
    size_t n = size < m->sent->len ? size : m->sent->len;
    if (n) {
        memcpy(data, m->sent->data, n);
        g_byte_array_remove_range(m->sent, 0, (guint)n);
    }
    return n;
}

size_t f405_machine_serial_write(struct f405_machine *m, const uint8_t *data, size_t size)
{
    return f405_uart_in(m->chip, SERIAL, data, size);
}

static const struct f405_machine_edge *edges(const GArray *array, int *count)
{
    *count = (int)array->len;
    return (const struct f405_machine_edge *)(const void *)array->data;
}

const struct f405_machine_edge *f405_machine_steps(const struct f405_machine *m, int *count)
{
    return edges(m->steps, count);
}

const struct f405_machine_edge *f405_machine_triggers(const struct f405_machine *m, int *count)
{
    return edges(m->triggers, count);
}

void f405_machine_forget_edges(struct f405_machine *m)
{
    g_array_set_size(m->steps, 0);
    g_array_set_size(m->triggers, 0);
}
