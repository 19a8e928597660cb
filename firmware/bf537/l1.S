/* SPDX-License-Identifier: Apache-2.0 */
/* The data memory within the processor: two banks, of which the upper half would be the data cache, and the
 * scratchpad. A stack that runs over its end leaves the memory that exists. */
    .global _bf537_l1_a_begin, _bf537_l1_a_end, _bf537_l1_b_begin, _bf537_l1_b_end
    .global _bf537_l1_stack_begin, _bf537_l1_stack_end
    .global _bf537_scratchpad_begin, _bf537_scratchpad_end
    .set _bf537_l1_a_begin, 0xFF800000
    .set _bf537_l1_a_end, 0xFF808000
    .set _bf537_l1_stack_begin, 0xFF900000
    .set _bf537_l1_stack_end, 0xFF903000
    .set _bf537_l1_b_begin, 0xFF903000
    .set _bf537_l1_b_end, 0xFF908000
    .set _bf537_scratchpad_begin, 0xFFB00000
    .set _bf537_scratchpad_end, 0xFFB01000

/* Parts of the work (core/parallel.h) have their stack there. */
    .text
    .global _parallel_call
_parallel_call:
    link 0;
    p0 = r0;
    r0 = r1;
    r1 = r2;
    p1.l = _bf537_l1_stack_end;
    p1.h = _bf537_l1_stack_end;
    p2.l = _bf537_l1_stack_begin;
    p2.h = _bf537_l1_stack_begin;
    /* A part of a part is there already. */
    cc = sp < p2 (iu);
    if cc sp = p1;
    [--sp] = fp; /* where the calls go on, for the report of a fault */
    sp += -12;
    call (p0);
    unlink;
    rts;
