// SPDX-License-Identifier: Apache-2.0
// Ends the program in the way that a key asks for, with the firmware's start-up, watchdog and
// reports: fault_test.py reads them.
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "bf537/clock.h"
#include "bf537/fault.h"
#include "bf537/mmr.h"
#include "bf537/serial.h"
#include "bf537/watchdog.h"
#include "core/invariant.h"
#include "core/parallel.h"

void bf537_interrupt(void);
_Noreturn void bf537_main(void);
void provoke_undefined_instruction(void);
void provoke_misaligned_access(void);
void provoke_broken_invariant(int value);
uint32_t provoke_deep_stack(uint32_t depth);

extern uint32_t stack_begin[] __asm__("_bf537_stack_begin");

static struct bf537_serial console;

void bf537_interrupt(void) {}

__attribute__((noinline)) void provoke_undefined_instruction(void) {
    __asm__ volatile(".short 0x0001;");
}

__attribute__((noinline)) void provoke_misaligned_access(void) {
    uint32_t word;
    __asm__ volatile("%0 = [%1];" : "=d"(word) : "a"(0x2001));
}

__attribute__((noinline)) void provoke_broken_invariant(int value) {
    INVARIANT(value == 0);
}

// Calls until the stack has run over its end, by less than what one call takes.
__attribute__((noinline)) uint32_t provoke_deep_stack(uint32_t depth) {
    volatile uint32_t words[32];
    for (uint32_t i = 0; i < 32; i++) {
        words[i] = depth;
    }
    const bool over = (uintptr_t)words <= (uintptr_t)stack_begin;
    return words[depth % 32] + (over ? 0 : provoke_deep_stack(depth + 1));
}

// A part of the work, on a stack of its own, with a part that is on it already.
__attribute__((noinline)) static void provoke_in_part(void *within, int depth) {
    if (depth > 0) {
        parallel_call(provoke_in_part, within, depth - 1);
    } else {
        provoke_undefined_instruction();
    }
}

__attribute__((noinline, section(".l1_text"))) static void provoke_in_l1(void) {
    parallel_call(provoke_in_part, NULL, 0);
    __asm__ volatile("");  // so that it is a call, and no jump
}

static char take_key(void) {
    while ((UART_LSR(UART0) & UART_LSR_DR) == 0) {
    }
    return (char)UART_RBR(UART0);
}

_Noreturn void bf537_main(void) {
    bf537_clock_begin();
    bf537_serial_open(&console, UART0, 57600);
    bf537_serial_send(&console, "started: ", 9);
    for (const char *at = bf537_fault_last(); *at != '\0'; at++) {
        bf537_serial_send(&console, at, 1);
    }
    bf537_serial_send(&console, "\n", 1);
    const char key = take_key();
    if (key == 'u') {
        provoke_undefined_instruction();
    } else if (key == 'm') {
        provoke_misaligned_access();
    } else if (key == 'i') {
        provoke_broken_invariant(1);
    } else if (key == 'p') {
        parallel_call(provoke_in_part, NULL, 1);
    } else if (key == 'l') {
        provoke_in_l1();
    } else if (key == 's') {
        (void)provoke_deep_stack(0);
        bf537_fault_check_stack();
    } else if (key == 'c') {
        DMEM_CONTROL |= DMEM_CACHED;
        bf537_fault_check_cache();
    }
    bf537_watchdog_start();
    for (;;) {
    }
}
