/* Pins: modes, outputs, inputs. RM0090 section 8.3. */
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#define MODE(pin, mode) ((uint32_t)GPIO_MODER_##mode << (2 * (pin)))
#define FIELD2(pin, value) ((uint32_t)(value) << (2 * (pin)))
#define AF(pin, function) ((uint32_t)(function) << (4 * ((pin) % 8)))
#define SET(pin) (1u << (pin))
#define RESET(pin) (1u << ((pin) + 16))

/* PUPDR of inputs 0 … 4, 6 … 11 of port C: pulled up. */
#define PULL_UP(pin) FIELD2(pin, GPIO_PUPDR_UP)

void pins_init(void)
{
    /* Levels first, then directions: motor energised and brake closed as they were in reset. */
    GPIO_BSRR(GPIOA_BASE) =
        RESET(PIN_A_RS485) | RESET(PIN_A_DIR) | RESET(PIN_A_ENABLE) | RESET(PIN_A_BRAKE) | RESET(PIN_A_LAMP);
    GPIO_BSRR(GPIOB_BASE) = 0xffff0000u;
    GPIO_BSRR(GPIOC_BASE) = RESET(PIN_C_STATUS);

    GPIO_AFRL(GPIOA_BASE) = AF(PIN_A_STEP, 1) | AF(PIN_A_TX, 7) | AF(PIN_A_RX, 7);
    GPIO_AFRH(GPIOA_BASE) = AF(PIN_A_DM, 10) | AF(PIN_A_DP, 10);
    GPIO_OSPEEDR(GPIOA_BASE) = FIELD2(PIN_A_STEP, GPIO_OSPEEDR_MEDIUM) | FIELD2(PIN_A_DM, GPIO_OSPEEDR_VERY_HIGH) |
                               FIELD2(PIN_A_DP, GPIO_OSPEEDR_VERY_HIGH) | FIELD2(13, GPIO_OSPEEDR_VERY_HIGH);
    /* 13 and 14 as after reset (section 8.4.4): debug port. */
    GPIO_PUPDR(GPIOA_BASE) = PULL_UP(PIN_A_RX) | FIELD2(13, GPIO_PUPDR_UP) | FIELD2(14, GPIO_PUPDR_DOWN);
    GPIO_MODER(GPIOA_BASE) = MODE(PIN_A_STEP, ALTERNATE) | MODE(PIN_A_RS485, OUTPUT) | MODE(PIN_A_TX, ALTERNATE) |
                             MODE(PIN_A_RX, ALTERNATE) | MODE(PIN_A_SUPPLY, ANALOG) | MODE(PIN_A_DIR, OUTPUT) |
                             MODE(PIN_A_ENABLE, OUTPUT) | MODE(PIN_A_BRAKE, OUTPUT) | MODE(PIN_A_LAMP, OUTPUT) |
                             MODE(PIN_A_DM, ALTERNATE) | MODE(PIN_A_DP, ALTERNATE) | MODE(13, ALTERNATE) |
                             MODE(14, ALTERNATE);

    GPIO_OSPEEDR(GPIOB_BASE) = 0;
    GPIO_PUPDR(GPIOB_BASE) = 0;
    GPIO_MODER(GPIOB_BASE) = 0x55555555u; /* all outputs */

    GPIO_AFRL(GPIOC_BASE) = AF(PIN_C_FEEDBACK0, 2) | AF(PIN_C_FEEDBACK0 + 1, 2);
    GPIO_AFRH(GPIOC_BASE) = AF(PIN_C_FEEDBACK0 + 2, 2) | AF(PIN_C_FEEDBACK0 + 3, 2);
    GPIO_PUPDR(GPIOC_BASE) = PULL_UP(PIN_C_ESTOP) | PULL_UP(PIN_C_INDEX) | PULL_UP(PIN_C_SLACK) |
                             PULL_UP(PIN_C_STRING_END) | PULL_UP(PIN_C_WOUND) | PULL_UP(PIN_C_FEEDBACK0) |
                             PULL_UP(PIN_C_FEEDBACK0 + 1) | PULL_UP(PIN_C_FEEDBACK0 + 2) |
                             PULL_UP(PIN_C_FEEDBACK0 + 3) | PULL_UP(PIN_C_DRIVER_FAULT) | PULL_UP(PIN_C_REACHED);
    GPIO_MODER(GPIOC_BASE) = MODE(PIN_C_STATUS, OUTPUT) | MODE(PIN_C_FEEDBACK0, ALTERNATE) |
                             MODE(PIN_C_FEEDBACK0 + 1, ALTERNATE) | MODE(PIN_C_FEEDBACK0 + 2, ALTERNATE) |
                             MODE(PIN_C_FEEDBACK0 + 3, ALTERNATE);
}

void pin_output(enum board_output output, bool active)
{
    switch (output) {
    case BOARD_OUT_ENABLE:
        GPIO_BSRR(GPIOA_BASE) = active ? RESET(PIN_A_ENABLE) : SET(PIN_A_ENABLE);
        break;
    case BOARD_OUT_BRAKE:
        GPIO_BSRR(GPIOA_BASE) = active ? SET(PIN_A_BRAKE) : RESET(PIN_A_BRAKE);
        break;
    case BOARD_OUT_LAMP:
        GPIO_BSRR(GPIOA_BASE) = active ? SET(PIN_A_LAMP) : RESET(PIN_A_LAMP);
        break;
    case BOARD_OUT_STATUS:
        GPIO_BSRR(GPIOC_BASE) = active ? SET(PIN_C_STATUS) : RESET(PIN_C_STATUS);
        break;
    case BOARD_OUTPUTS:
        break;
    }
}

bool pin_input(enum board_input input)
{
    static const uint8_t pins[BOARD_INPUTS] = {
        [BOARD_IN_ESTOP] = PIN_C_ESTOP,    [BOARD_IN_INDEX] = PIN_C_INDEX,
        [BOARD_IN_SLACK] = PIN_C_SLACK,    [BOARD_IN_STRING_END] = PIN_C_STRING_END,
        [BOARD_IN_WOUND] = PIN_C_WOUND,    [BOARD_IN_DRIVER_FAULT] = PIN_C_DRIVER_FAULT,
        [BOARD_IN_REACHED] = PIN_C_REACHED};
    const bool high = GPIO_IDR(GPIOC_BASE) >> pins[input] & 1;

    return input == BOARD_IN_REACHED ? !high : high;
}

bool pin_feedback(int input)
{
    return !(GPIO_IDR(GPIOC_BASE) >> (PIN_C_FEEDBACK0 + input) & 1);
}

/* PM0214 sections 4.3.2, 4.3.7 */
void interrupt_enable(unsigned irq, unsigned priority)
{
    NVIC_IPR_BYTE(irq) = (uint8_t)(priority << 4);
    NVIC_ISER(irq / 32) = 1u << (irq % 32);
}
