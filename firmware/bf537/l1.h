// SPDX-License-Identifier: Apache-2.0
/// The memory within the processor, which needs no bus (l1.S, l1_code.ld).
#ifndef VERGENCE_BF537_L1_H
#define VERGENCE_BF537_L1_H

#include <stddef.h>
#include <stdint.h>

#include "core/arena.h"

extern uint8_t bf537_l1_a_begin[] __asm__("_bf537_l1_a_begin");
extern uint8_t bf537_l1_a_end[] __asm__("_bf537_l1_a_end");
extern uint8_t bf537_l1_b_begin[] __asm__("_bf537_l1_b_begin");
extern uint8_t bf537_l1_b_end[] __asm__("_bf537_l1_b_end");
extern uint8_t bf537_scratchpad_begin[] __asm__("_bf537_scratchpad_begin");
extern uint8_t bf537_scratchpad_end[] __asm__("_bf537_scratchpad_end");

/// The stack of `parallel_call`.
extern uint32_t bf537_l1_stack_begin[] __asm__("_bf537_l1_stack_begin");
extern uint32_t bf537_l1_stack_end[] __asm__("_bf537_l1_stack_end");

/// Code that runs in L1, and its copy in SDRAM, which loads can read.
extern uint8_t bf537_l1_text_begin[] __asm__("_bf537_l1_text_begin");
extern uint8_t bf537_l1_text_end[] __asm__("_bf537_l1_text_end");
extern uint8_t bf537_l1_text_load[] __asm__("_bf537_l1_text_load");

/// Lends both banks of data, without the stack of `parallel_call`, and the scratchpad.
static inline void bf537_l1_lend(struct arena *arena) {
    arena_lend_fast(arena, bf537_scratchpad_begin,
                    (size_t)(bf537_scratchpad_end - bf537_scratchpad_begin));
    arena_lend_fast(arena, bf537_l1_b_begin, (size_t)(bf537_l1_b_end - bf537_l1_b_begin));
    arena_lend_fast(arena, bf537_l1_a_begin, (size_t)(bf537_l1_a_end - bf537_l1_a_begin));
}

#endif
