// SPDX-License-Identifier: Apache-2.0
// The instrument without an operating system: one loop that serves the console and the rig.
#include <stddef.h>
#include <stdint.h>

#include "bf537/clock.h"
#include "bf537/commands.h"
#include "bf537/console.h"
#include "bf537/fault.h"
#include "bf537/flags.h"
#include "bf537/flash.h"
#include "bf537/l1.h"
#include "bf537/mmr.h"
#include "bf537/ppi.h"
#include "bf537/serial.h"
#include "bf537/twi.h"
#include "bf537/watchdog.h"
#include "core/error.h"
#include "core/invariant.h"
#include "memory/calibration.h"
#include "memory/pair.h"
#include "rig/base/profile.h"
#include "rig/rig.h"

enum {
    CONSOLE_BAUD = 57600,
    TWI_HZ = 100000,
    IDLE_US = 50000,
    FRAMES_BYTES = 26 << 20,  // four frames of 2048 x 1536
};

extern uint8_t _bf537_pool_begin[] __asm__("_bf537_pool_begin");
extern uint8_t _bf537_pool_end[] __asm__("_bf537_pool_end");

static struct bf537_serial console_serial, lens_serial;
static struct bf537_console console;
static struct rig rig;

void bf537_interrupt(void);
_Noreturn void bf537_main(void);

/// Every interrupt: the UARTs' bytes. That of the timer only ends a sleep.
void bf537_interrupt(void) {
    bf537_end_sleep();
    bf537_serial_receive(&console_serial);
    bf537_serial_receive(&lens_serial);
}

static void write_log(void *self, enum hal_log_level level, const char *text) {
    (void)self;
    (void)level;
    (void)text;
}

static void enable_interrupts(void) {
    const uint32_t mask =
        1u << IVG_HARDWARE_ERROR | 1u << IVG_TIMER | 1u << IVG_DEVICES | 1u << IVG_MAIN;
    // All peripherals that interrupt do so at one level: 10 is 7 + 3.
    for (int i = 0; i < 4; i++) {
        SIC_IAR(i) = 0x33333333;
    }
    SIC_IMASK = 1u << SIC_UART0_RX | 1u << SIC_UART0_TX | 1u << SIC_UART1_RX | 1u << SIC_UART1_TX;
    SIC_IWR = 0xFFFFFFFF;
    ssync();
    __asm__ volatile("sti %0;" : : "d"(mask) : "memory");
}

_Noreturn void bf537_main(void) {
    static const struct hal_log_operations log_operations = {write_log};
    static const struct hal_log log = {&log_operations, NULL};
    struct rig_profile profile;
    bf537_clock_begin();
    (void)bf537_fault_last();
    const int error = rig_profile_named("rig", &profile);
    INVARIANT(error == ERROR_OK);
    bf537_serial_open(&console_serial, UART0, CONSOLE_BAUD);
    bf537_serial_open(&lens_serial, UART1, profile.lens.bits_per_s);
    bf537_fault_check_cache();
    enable_interrupts();
    const struct hal_i2c *i2c = bf537_twi_open(TWI_HZ);
    const struct hal_camera *camera = bf537_ppi_open(_bf537_pool_begin, FRAMES_BYTES);
    const struct rig_ports ports = {.clock = bf537_clock(),
                                    .i2c = i2c,
                                    .gpio = bf537_flags_open(),
                                    .camera = {camera, camera},
                                    .lens_uart = &lens_serial.port,
                                    .log = &log};
    const struct rig_observer observer = bf537_console_observer(&console);
    rig_init(&rig, &profile, &ports, &observer);
    uint8_t *const rest = _bf537_pool_begin + FRAMES_BYTES;
    struct arena lent;
    arena_init(&lent, rest, (size_t)(_bf537_pool_end - rest));
    bf537_l1_lend(&lent);
    memory_pair_begin(&lent);
    memory_calibration_begin(bf537_flash_open(&observer));  // a second, without the watchdog
    bf537_watchdog_start();
    bf537_console_begin(&console, &console_serial, &rig, bf537_commands());
    for (;;) {
        bf537_console_step(&console);
        rig_idle(&rig);
        bf537_watchdog_feed();
        bf537_fault_check_stack();
        bf537_sleep_until_us(bf537_now_us() + IDLE_US);
    }
}
