// SPDX-License-Identifier: Apache-2.0
#include "bf537/flags.h"

#include <stddef.h>

#include "bf537/mmr.h"
#include "core/error.h"

enum { PIN_IRQ = 1 << 10, PIN_RESET_N = 1 << 11 };
// Pins that belong to peripherals (HARDWARE.md): UART0 PF0-1, UART1 PF2-3, the PPI's syncs PF7-9
// and clock PF15, its data PG0-9.
enum { PORT_F_PERIPHERALS = 0x838F, PORT_G_PERIPHERALS = 0x03FF };

static int set_line(void *self, enum hal_gpio_line line, bool active) {
    (void)self;
    if (line != HAL_GPIO_BRIDGE_RESET) {
        return ERROR_UNSUPPORTED;
    }
    if (active) {
        PORTGIO_CLEAR = PIN_RESET_N;
    } else {
        PORTGIO_SET = PIN_RESET_N;
    }
    ssync();
    return ERROR_OK;
}

static int get_line(void *self, enum hal_gpio_line line, bool *active) {
    (void)self;
    if (line != HAL_GPIO_BRIDGE_RESET && line != HAL_GPIO_BRIDGE_IRQ) {
        return ERROR_UNSUPPORTED;
    }
    const uint16_t pins = PORTGIO;
    *active = line == HAL_GPIO_BRIDGE_IRQ ? (pins & PIN_IRQ) != 0 : (pins & PIN_RESET_N) == 0;
    return ERROR_OK;
}

const struct hal_gpio *bf537_flags_open(void) {
    static const struct hal_gpio_operations operations = {set_line, get_line};
    static const struct hal_gpio lines = {&operations, NULL};
    PORTF_FER = PORT_F_PERIPHERALS;
    PORTG_FER = PORT_G_PERIPHERALS;
    PORTGIO_SET = PIN_RESET_N;
    PORTGIO_DIR = PIN_RESET_N;
    PORTGIO_INEN = PIN_IRQ;
    ssync();
    return &lines;
}
