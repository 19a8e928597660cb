// SPDX-License-Identifier: Apache-2.0
#include "bf537/fault.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "bf537/l1.h"
#include "bf537/mmr.h"
#include "bf537/watchdog.h"
#include "console/command_text.h"
#include "core/decimal.h"
#include "core/invariant.h"

enum {
    REASON_BYTES = 160,
    RETAINED_MAGIC = 0x46415531,
    STACK_FILL = 0x5A5A5A5A,
    GUARD_WORDS = 16,
    CALLS_MAX = 16,
    CAUSE_MASK = 0x3F,  // of SEQSTAT: exceptions, then hardware errors
    HARDWARE_SHIFT = 14,
    HARDWARE_MASK = 0x1F,
};

/// Registers, in the order in which start.S pushes them, from the last.
struct frame {
    uint32_t p5_to_p0[6], r7_to_r0[8];
    uint32_t fp, rets, retx, reti, sp;
};

extern uint32_t _bf537_stack_begin[] __asm__("_bf537_stack_begin");
extern uint32_t _bf537_stack_end[] __asm__("_bf537_stack_end");
extern uint8_t _bf537_text_begin[] __asm__("_bf537_text_begin");
extern uint8_t _bf537_text_end[] __asm__("_bf537_text_end");

/// Survives a restart.
static struct {
    uint32_t magic;
    char reason[REASON_BYTES];
} retained __attribute__((section(".retained")));

static char last_reason[REASON_BYTES];

/// Causes of exceptions (Programming Reference, table 4-11).
static const char *exception_text(uint32_t cause) {
    switch (cause) {
        case 0x21:
            return "undefined instruction";
        case 0x22:
            return "illegal combination of instructions";
        case 0x23:
            return "access to protected data";
        case 0x24:
            return "misaligned access to data";
        case 0x25:
            return "unrecoverable event (double fault)";
        case 0x26:
            return "access to data that do not exist";
        case 0x2A:
            return "misaligned instruction";
        case 0x2B:
            return "instruction in protected memory";
        case 0x2C:
            return "instruction in memory that does not exist";
        case 0x2E:
            return "instruction of a higher privilege";
        default:
            return "exception";
    }
}

/// Causes of hardware errors, which are reported some instructions late (table 4-12).
static const char *hardware_error_text(uint32_t cause) {
    switch (cause) {
        case 0x02:
            return "hardware error: a system register that does not exist,";
        case 0x03:
            return "hardware error: memory that does not exist,";
        default:
            return "hardware error";
    }
}

static void print(const char *text) {
    for (const char *at = text; *at != '\0'; at++) {
        while ((UART_LSR(UART0) & UART_LSR_THRE) == 0) {
        }
        UART_THR(UART0) = (uint16_t)(unsigned char)*at;
    }
}

static void print_register(const char *name, uint32_t value) {
    char line[32];
    struct command_text text = command_text_begin(line, sizeof line);
    command_text_join(&text, " ", name, "=");
    command_text_add_hex(&text, value, 8);
    print(line);
}

static bool is_within(uint32_t address, const void *begin, const void *end) {
    return address >= (uint32_t)(uintptr_t)begin && address < (uint32_t)(uintptr_t)end;
}

/// Whether a call ends right before the address: CALL of 4 bytes, or through a register. Of code in
/// L1 only the copy in SDRAM can be read.
static bool follows_call(uint32_t address) {
    uint32_t call = address - 4;
    if (is_within(call, bf537_l1_text_begin, bf537_l1_text_end)) {
        call += (uint32_t)(bf537_l1_text_load - bf537_l1_text_begin);
    }
    const uint16_t *code = (const uint16_t *)(uintptr_t)call;
    return call % 2 == 0 && is_within(call, _bf537_text_begin, _bf537_text_end) &&
           ((code[0] & 0xFF00) == 0xE300 || (code[1] & 0xFFE8) == 0x0060);
}

/// Return addresses on the stack, the innermost first. That of a part of the work has the place on
/// the other one where it was called at its begin (l1.S).
static void print_calls(uint32_t sp, uint32_t rets) {
    int printed = 0;
    print("calls:");
    print_register("rets", rets);
    uint32_t at = sp & ~3u;
    const bool in_part = is_within(at, bf537_l1_stack_begin, bf537_l1_stack_end);
    if (!in_part && !is_within(at, _bf537_stack_begin, _bf537_stack_end)) {
        at = (uint32_t)(uintptr_t)_bf537_stack_begin;
    }
    while (at != (uint32_t)(uintptr_t)_bf537_stack_end && printed < CALLS_MAX) {
        const uint32_t value = *(const uint32_t *)(uintptr_t)at;
        at += 4;
        if (follows_call(value)) {
            print_register("", value);
            printed++;
        }
        if (at == (uint32_t)(uintptr_t)bf537_l1_stack_end) {
            at = value;
        }
    }
    print("\r\n");
}

static void keep_reason(const char *reason) {
    retained.magic = RETAINED_MAGIC;
    struct command_text text = command_text_begin(retained.reason, sizeof retained.reason);
    command_text_add(&text, reason);
}

static _Noreturn void restart(const char *reason) {
    keep_reason(reason);
    print("\r\nfault: ");
    print(reason);
    print("\r\nthe watchdog restarts the board; \"board\" then shows this reason\r\n");
    bf537_watchdog_restart();
}

void bf537_fault(const struct frame *frame, uint32_t seqstat);

void bf537_fault(const struct frame *frame, uint32_t seqstat) {
    static const char *const p_names[] = {"p5", "p4", "p3", "p2", "p1", "p0"};
    static const char *const r_names[] = {"r7", "r6", "r5", "r4", "r3", "r2", "r1", "r0"};
    char reason[REASON_BYTES];
    struct command_text text = command_text_begin(reason, sizeof reason);
    const bool exception = (IPEND & 1u << IVG_EXCEPTION) != 0;
    command_text_join(&text,
                      exception ? exception_text(seqstat & CAUSE_MASK)
                                : hardware_error_text(seqstat >> HARDWARE_SHIFT & HARDWARE_MASK),
                      " at ");
    command_text_add_hex(&text, exception ? frame->retx : frame->reti, 8);
    print("\r\nregisters:");
    for (int i = 7; i >= 0; i--) {
        print_register(r_names[i], frame->r7_to_r0[i]);
    }
    print("\r\n ");
    for (int i = 5; i >= 0; i--) {
        print_register(p_names[i], frame->p5_to_p0[i]);
    }
    print_register("fp", frame->fp);
    print_register("sp", frame->sp);
    print_register("seqstat", seqstat);
    print_register("retx", frame->retx);
    print_register("reti", frame->reti);
    print("\r\n");
    print_calls(frame->sp, frame->rets);
    restart(reason);
}

void invariant_failed(const char *file, int line, const char *condition) {
    char reason[REASON_BYTES], number[DECIMAL_TEXT_BYTES];
    struct command_text text = command_text_begin(reason, sizeof reason);
    const char *name = strrchr(file, '/');
    decimal_print_integer(line, number);
    command_text_join(&text, "internal error at ", name != NULL ? name + 1 : file, ":", number,
                      ": ", condition);
    restart(reason);
}

void bf537_fault_check_stack(void) {
    for (int i = 0; i < GUARD_WORDS; i++) {
        if (_bf537_stack_begin[i] != STACK_FILL || bf537_l1_stack_begin[i] != STACK_FILL) {
            restart("the stack ran over its end");
        }
    }
}

void bf537_fault_check_cache(void) {
    if ((DMEM_CONTROL & DMEM_CACHED) != 0) {
        restart("the data cache is on (in U-Boot: dcache off)");
    }
}

static struct bf537_stack measure_stack(const uint32_t *begin, const uint32_t *end) {
    const uint32_t *lowest = begin;
    while (lowest < end && *lowest == STACK_FILL) {
        lowest++;
    }
    return (struct bf537_stack){(size_t)(end - begin) * sizeof *begin,
                                (size_t)(end - lowest) * sizeof *begin};
}

struct bf537_stack bf537_stack(void) {
    return measure_stack(_bf537_stack_begin, _bf537_stack_end);
}

struct bf537_stack bf537_l1_stack(void) {
    return measure_stack(bf537_l1_stack_begin, bf537_l1_stack_end);
}

const char *bf537_fault_last(void) {
    if (last_reason[0] != '\0') {
        return last_reason;
    }
    struct command_text text = command_text_begin(last_reason, sizeof last_reason);
    if (retained.magic == RETAINED_MAGIC) {
        retained.reason[sizeof retained.reason - 1] = '\0';
        command_text_add(&text, retained.reason);
    } else {
        command_text_add(&text, bf537_watchdog_restart_text());
    }
    retained.magic = 0;
    return last_reason;
}
