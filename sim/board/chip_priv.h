/* What the files of the emulated STM32F405 share. */
#ifndef LUMI_SIM_BOARD_CHIP_PRIV_H
#define LUMI_SIM_BOARD_CHIP_PRIV_H

#include "sim/board/f405.h"

#include <unicorn/unicorn.h>

#define RAM_SIZE 0x20000u
#define CCM_SIZE 0x10000u
#define SECTORS 12
#define TIMERS 15 /* 1 .. 14 */
#define BLOCKS 16384

enum { EX_NMI = 2, EX_HARDFAULT = 3, EX_SVCALL = 11, EX_PENDSV = 14, EX_SYSTICK = 15, EX_IRQ = 16 };

struct cpu {
    uint32_t vtor, ccr, scr, shcsr, cpacr, demcr, dwt_ctrl, aircr_group;
    uint64_t dwt_base;
    uint8_t priority[F405_EXCEPTIONS];
    bool enabled[F405_EXCEPTIONS], pending[F405_EXCEPTIONS], active[F405_EXCEPTIONS], line[F405_EXCEPTIONS];
    uint64_t pended[F405_EXCEPTIONS];
    int stack[32], depth; /* exceptions that are active, innermost last */
    uint32_t spent[32];   /* instructions of each */
    int candidate;        /* the most urgent that is pending and enabled; 0: none */
    uint32_t systick_ctrl, systick_load;
    uint64_t systick_base, systick_next; /* when the counter was, will be 0 */
    bool systick_flag;
    bool asleep, event;
    uint32_t exception_return; /* EXC_RETURN that was branched to; 0: none */
    struct f405_exception_stats stats[F405_EXCEPTIONS];
};

struct rcc {
    uint32_t reg[36];                            /* by offset / 4 */
    unsigned cost;                               /* cycles of 168 MHz an instruction takes */
    unsigned apb1, apb2, tim1_clock, tim2_clock; /* cycles of 168 MHz a clock of the buses and their timers takes */
    uint64_t hse_ready, pll_ready;               /* when; F405_NEVER: off, or it does not swing */
    bool no_crystal;
};

struct flash {
    uint32_t acr, sr, cr, optcr;
    int unlock; /* keys given */
    bool locked_out;
    bool stale;    /* the data cache may hold what an erase has changed */
    uint64_t done; /* F405_NEVER: idle */
    uint64_t cut_at;
    unsigned cut_operation;
    int sector;             /* being erased, or −1 */
    uint32_t address, size; /* being programmed */
    uint8_t before[8];      /* what stood there */
    /* A write that Unicorn will carry out behind the model's back; put right at the next look. */
    uint32_t fix_address, fix_size;
    uint8_t fix[8];
};

struct gpio {
    uint32_t moder, otyper, ospeedr, pupdr, odr, lckr, afr[2];
};
struct pin {
    uint8_t output, driven, level; /* enum f405_level: the chip's; the outside's; the wire's (low or high) */
};

struct exti {
    uint32_t imr, emr, rtsr, ftsr, pr;
    uint32_t memrmp, pmc, cr[4];
};

struct timer {
    uint32_t cr1, cr2, smcr, dier, sr, ccmr[2], ccer, psc, arr, rcr, ccr[4], bdtr, dcr;
    uint32_t psc_now, arr_now, ccr_now[4], repeat;
    uint32_t cnt; /* at cycle `base` */
    uint64_t base;
    bool ref[4], shown[4]; /* OCxREF; what the output last was */
};

struct dma_stream {
    uint32_t cr, ndtr, par, m0ar, m1ar, fcr;
    uint32_t reload, at; /* items of a round; items moved */
};
struct dma {
    uint32_t isr[2];
    struct dma_stream stream[8];
};

struct usart {
    uint32_t sr, dr, brr, cr1, cr2, cr3, gtpr;
    bool sending, holding, sr_read, framing_error;
    uint8_t shift, hold;
    uint64_t sent, arrives, idle;
    uint8_t queue[4096];
    unsigned head, tail;
};

struct adc {
    uint32_t sr, cr1, cr2, smpr[2], sqr[3], dr, htr, ltr;
    uint64_t done;
    int rank;
    bool at_reading;
};

struct watchdog {
    uint32_t pr, rlr, rlr_before;
    bool started, writable;
    uint64_t expires, pr_taken, rlr_taken; /* when what was written holds */
};

struct otg_endpoint {
    uint32_t ctl, interrupt, tsiz;
    bool data1;          /* the toggle of the next packet */
    uint8_t fifo[2048];  /* IN: words that wait to be sent */
    unsigned fifo_bytes; /* always whole words */
};
struct otg_entry {
    uint32_t status; /* as GRXSTSP shows it */
    uint8_t data[64];
};
struct otg {
    uint32_t gotgctl, gotgint, gahbcfg, gusbcfg, gintsts, gintmsk, grxfsiz, dieptxf[4], gccfg, cid;
    uint32_t dcfg, dctl, dsts, diepmsk, doepmsk, daintmsk, diepempmsk, pcgcctl, dvbusdis, dvbuspulse;
    struct otg_endpoint in[4], out[4];
    struct otg_entry receive[128]; /* the receive FIFO */
    unsigned head, tail, words;    /* entries; words they take */
    unsigned read_at, read_end;    /* of the data of the entry that was popped last */
    uint8_t popped[64];
    int address;        /* that tokens are answered at */
    bool address_waits; /* DCFG has another, which holds after the status stage */
    bool vbus;
    uint64_t reset_end; /* ENUMDNE comes */
};

struct block {
    uint32_t address, size, instructions;
};

struct f405 {
    const struct f405_ops *ops;
    void *context;
    uc_engine *uc;
    uc_hook hooks[4];
    uint64_t now, until, next; /* next: the earliest event of anything */
    uint64_t instructions;
    bool on, stop, reset_wanted, off_wanted, attention, hook_stopped;
    uint32_t reset_flags; /* RCC_CSR bits of the reset that is wanted */
    uint32_t resets, block_address, previous_block;
    enum f405_stop reason;
    char fault[256];
    uint64_t random;
    uint8_t *flash_bytes, *ram, *ccm, *system;
    struct block *blocks;
    struct cpu cpu;
    struct rcc rcc;
    struct flash flash;
    struct gpio gpio[9];
    struct pin pin[F405_PINS];
    struct exti exti;
    struct timer timer[TIMERS];
    struct dma dma[2];
    struct usart usart[F405_USARTS];
    struct adc adc;
    struct watchdog watchdog;
    struct otg otg;
    unsigned sunk; /* mV below 3,300 of the chip's supply */
    uint32_t pwr_cr, dbgmcu[4], rng_cr, crc, adc_ccr;
};

/* Stops the run; the first text stays. */
void f405_complain(struct f405 *chip, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Recomputes when the next event is; after anything that a register's writing may have changed. */
void f405_schedule(struct f405 *chip);
void f405_run_events(struct f405 *chip);
void f405_want_reset(struct f405 *chip, uint32_t flags);
uint32_t f405_random(struct f405 *chip);
/* The bus as DMA sees it. */
uint32_t f405_bus_read(struct f405 *chip, uint32_t address, unsigned size);
void f405_bus_write(struct f405 *chip, uint32_t address, unsigned size, uint32_t value);
/* A register behind a peripheral's base, by its number there. */
bool f405_mmio(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t *value);

/* chip_cpu.c: exceptions and the private peripheral bus. */
void f405_cpu_reset(struct f405 *chip);
bool f405_cpu_wakes(const struct f405 *chip);
void f405_cpu_irq(struct f405 *chip, int irq, bool level);
void f405_cpu_pend(struct f405 *chip, int exception);
void f405_cpu_update(struct f405 *chip);
bool f405_cpu_deliverable(struct f405 *chip);
void f405_cpu_enter(struct f405 *chip);
void f405_cpu_return(struct f405 *chip);
uint64_t f405_cpu_next(const struct f405 *chip);
void f405_cpu_event(struct f405 *chip);
bool f405_ppb_access(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t *value);

/* A peripheral's registers: `value` in and out; false: no such register. */
typedef bool f405_peripheral_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value);
f405_peripheral_access f405_rcc_access, f405_pwr_access, f405_dbgmcu_access, f405_iwdg_access, f405_rng_access,
    f405_crc_access, f405_flash_access, f405_gpio_access, f405_exti_access, f405_syscfg_access, f405_timer_access,
    f405_dma_access, f405_usart_access, f405_adc_access, f405_otg_access;

void f405_rcc_reset(struct f405 *chip, uint32_t flags);
bool f405_rcc_enabled(const struct f405 *chip, uint32_t offset, int bit);
uint32_t f405_rcc_usb_hz(struct f405 *chip); /* of the PLL's output Q; 0: it is off */
uint64_t f405_iwdg_next(const struct f405 *chip);
void f405_iwdg_event(struct f405 *chip);

void f405_flash_reset(struct f405 *chip);
bool f405_flash_write_hook(struct f405 *chip, uint32_t address, unsigned size, uint64_t value);
void f405_flash_fix(struct f405 *chip);
void f405_flash_event(struct f405 *chip);
void f405_flash_power_cut(struct f405 *chip);

void f405_gpio_reset(struct f405 *chip);
void f405_gpio_update(struct f405 *chip, int pin, uint64_t at);
/* Whether a pin is switched to this alternate function; whether it is analog. */
bool f405_gpio_is(const struct f405 *chip, int pin, unsigned function);
bool f405_gpio_is_analog(const struct f405 *chip, int pin);
/* The output of a peripheral that may be routed to pins has changed. */
void f405_gpio_timer_output(struct f405 *chip, int timer, int channel, uint64_t at);
void f405_exti_edge(struct f405 *chip, int line, bool rising);

void f405_timer_reset(struct f405 *chip);
uint64_t f405_timer_next(const struct f405 *chip, int index);
void f405_timer_sync(struct f405 *chip, int index, uint64_t to);
bool f405_timer_level(const struct f405 *chip, int index, int channel);
void f405_timer_pin_edge(struct f405 *chip, int index, int channel, bool level, uint64_t at);
uint32_t f405_timer_count(const struct f405 *chip, int index, uint64_t at);

/* One item of whatever stream listens to `channel`; false: none is enabled. */
bool f405_dma_request(struct f405 *chip, int dma, int stream, int channel);

void f405_usart_reset(struct f405 *chip);
uint64_t f405_usart_next(const struct f405 *chip, int index);
void f405_usart_event(struct f405 *chip, int index);
void f405_usart_pump(struct f405 *chip, int index);

void f405_adc_event(struct f405 *chip);
void f405_otg_reset(struct f405 *chip);
void f405_otg_event(struct f405 *chip);

static inline uint32_t bits(uint32_t value, int low, int count)
{
    return value >> low & ((1u << count) - 1u);
}

#endif
