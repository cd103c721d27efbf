/* A program for the emulated board's core alone: what its exceptions do is told letter by letter on USART1. Expected
 * by board_core.c. */
#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define BYTE(address) (*(volatile uint8_t *)(uintptr_t)(address))
#define PEND(irq) (REG(0xE000E200) = 1u << (irq))
#define BARRIER() __asm__ volatile("dsb\n\tisb" ::: "memory")

int main(void);
void reset(void);
void irq6(void);
void irq7(void);
void irq8(void);
void systick(void);

extern uint32_t stack_top;
static volatile int nested;

static void tell(char letter)
{
    while (!(REG(0x40011000) & 0x80))
        ;
    REG(0x40011004) = (uint32_t)letter;
}

/* Pends a more urgent one, which comes at once, and an equal one, which waits. */
void irq6(void)
{
    tell('a');
    if (nested) {
        PEND(7);
        BARRIER();
        PEND(8);
        BARRIER();
        tell('b');
    }
}

void irq7(void)
{
    tell('C');
}

/* Uses the registers that belong to whom it interrupts. */
void irq8(void)
{
    __asm__ volatile("vmov.f32 s0, #9.0\n\tvmov.f32 s15, #9.0" ::: "s0", "s15");
    tell('d');
}

void systick(void)
{
    REG(0xE000E010) = 0;
    tell('s');
}

static void order(void)
{
    nested = 1;
    PEND(6);
    BARRIER();
    nested = 0;
    tell(' ');
    __asm__ volatile("cpsid i");
    PEND(8);
    PEND(7);
    PEND(6);
    BARRIER();
    tell('-');
    __asm__ volatile("cpsie i\n\tisb");
    tell(' ');
    __asm__ volatile("msr basepri, %0" ::"r"(0x20));
    PEND(6);
    PEND(7);
    BARRIER();
    tell('-');
    __asm__ volatile("msr basepri, %0\n\tisb" ::"r"(0));
    tell(' ');
}

int main(void)
{
    float before = 1.5f, low, high;
    REG(0x40023844) = 1u << 4; /* USART1's clock */
    REG(0x40023830) = 1u << 0; /* GPIOA's: PA9 is its line, function 7 */
    REG(0x40020024) = 7u << 4;
    REG(0x40020000) = 0xA8080000;
    REG(0x40011008) = 16; /* 1 Mbit/s */
    REG(0x4001100C) = 0x2008;
    REG(0xE000ED88) = 0xf00000; /* the FPU */
    BARRIER();
    BYTE(0xE000E406) = 0x20;
    BYTE(0xE000E407) = 0x10;
    BYTE(0xE000E408) = 0x20;
    REG(0xE000E100) = 7u << 6;
    order();
    /* Sleeps until SysTick pends, though it is masked. */
    __asm__ volatile("cpsid i");
    REG(0xE000E014) = 16000 - 1;
    REG(0xE000E018) = 0;
    REG(0xE000E010) = 7;
    __asm__ volatile("wfi");
    tell('w');
    __asm__ volatile("cpsie i\n\tisb");
    tell(' ');
    __asm__ volatile("vmov s0, %2\n\tvmov s15, %2\n\tstr %3, [%4]\n\tdsb\n\tisb\n\tvmov %0, s0\n\tvmov %1, s15"
                     : "=&r"(low), "=&r"(high)
                     : "r"(before), "r"(1u << 8), "r"(0xE000E200)
                     : "s0", "s15", "memory");
    tell(low == before && high == before ? 'f' : 'X');
    tell('.');
    for (;;)
        __asm__ volatile("wfi");
}

void reset(void)
{
    nested = 0;
    main();
}

__attribute__((section(".vectors"), used)) static void *const vectors[16 + 9] = {
    [0] = &stack_top,        [1] = (void *)reset,     [15] = (void *)systick,
    [16 + 6] = (void *)irq6, [16 + 7] = (void *)irq7, [16 + 8] = (void *)irq8,
};
