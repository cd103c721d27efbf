/* What the emulated board's interrupts took, as a table: for the scenarios and the benchmark. */
#ifndef LUMI_TESTS_SCENARIO_BOARD_INTERRUPTS_H
#define LUMI_TESTS_SCENARIO_BOARD_INTERRUPTS_H

#include "sim/board/f405.h"

#include <stdio.h>

static inline const char *board_interrupt_name(int exception)
{
    static const struct {
        int exception;
        const char *name;
    } names[] = {{14, "PendSV"},          {15, "SysTick"},         {22, "EXTI0 (e-stop)"}, {23, "EXTI1 (index)"},
                 {24, "EXTI2 (slack)"},   {25, "EXTI3"},           {26, "EXTI4 (wound)"},  {33, "DMA1 stream 6"},
                 {44, "TIM2 (steps)"},    {45, "TIM3 (feedback)"}, {54, "USART2"},         {56, "EXTI15_10"},
                 {66, "TIM5 (triggers)"}, {83, "OTG_FS"}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (names[i].exception == exception)
            return names[i].name;
    return "?";
}

static inline void board_print_interrupts(struct f405 *chip)
{
    printf("%-18s %9s %12s %12s %14s\n", "interrupt", "count", "instr mean", "instr most", "latency most");
    for (int i = 1; i < F405_EXCEPTIONS; i++) {
        const struct f405_exception_stats *s = f405_stats(chip, i);
        if (s->count)
            printf("%-18s %9llu %12.1f %12u %11llu cy\n", board_interrupt_name(i), (unsigned long long)s->count,
                   (double)s->instructions / (double)s->count, s->instructions_max, (unsigned long long)s->latency_max);
    }
}

#endif
