/* SPDX-License-Identifier: Apache-2.0 */
/* Reset and events of the BF537. The program runs at the lowest interrupt level (IVG15), so that exceptions
 * and the interrupts of devices get through; it never returns to user mode. */
#define EVT_LOW 0x2000
#define EVT_HIGH 0xFFE0

    .section .start, "ax"
    .global __start
__start:
    cli r0;
    /* SYSCFG: count cycles (bit 1), self-nesting stays off. */
    r0 = 0x32 (z);
    syscfg = r0;
    sp.l = _bf537_stack_end;
    sp.h = _bf537_stack_end;
    fp = sp;
    l0 = 0;
    l1 = 0;
    l2 = 0;
    l3 = 0;
    r0 = 0;
    cycles = r0;
    cycles2 = r0;

    /* Zero what is not initialised, then fill the stacks with what the high-water mark is found by. */
    p0.l = _bf537_bss_begin;
    p0.h = _bf537_bss_begin;
    p1.l = _bf537_bss_end;
    p1.h = _bf537_bss_end;
    call fill;
    p0.l = _bf537_stack_begin;
    p0.h = _bf537_stack_begin;
    p1.l = _bf537_stack_end;
    p1.h = _bf537_stack_end;
    r0.l = 0x5A5A;
    r0.h = 0x5A5A;
    call fill;
    p0.l = _bf537_l1_stack_begin;
    p0.h = _bf537_l1_stack_begin;
    p1.l = _bf537_l1_stack_end;
    p1.h = _bf537_l1_stack_end;
    call fill;

    /* Events: 2 is NMI, 3 exceptions, 5 hardware errors, 6 the core's timer, 7 to 13 devices. */
    p0.l = EVT_LOW;
    p0.h = EVT_HIGH;
    r0.l = fault;
    r0.h = fault;
    r1.l = interrupt;
    r1.h = interrupt;
    [p0 + 4 * 2] = r0;
    [p0 + 4 * 3] = r0;
    [p0 + 4 * 5] = r0;
    [p0 + 4 * 6] = r1;
    [p0 + 4 * 7] = r1;
    [p0 + 4 * 8] = r1;
    [p0 + 4 * 9] = r1;
    [p0 + 4 * 10] = r1;
    [p0 + 4 * 11] = r1;
    [p0 + 4 * 12] = r1;
    [p0 + 4 * 13] = r1;
    r1.l = begin;
    r1.h = begin;
    [p0 + 4 * 15] = r1;
    csync;

    /* Leave the level of reset for that of the program. */
    r0 = 0x8000 (z);
    sti r0;
    raise 15;
    r0.l = wait;
    r0.h = wait;
    reti = r0;
    rti;
wait:
    jump wait;

begin:
    [--sp] = reti; /* other events may interrupt from here on */
    sp += -12;
    call _bf537_l1_load_text;
    call _bf537_main;
halt:
    idle;
    jump halt;

/* Words from p0 to p1 become r0. */
fill:
    cc = p0 < p1 (iu);
    if !cc jump filled;
    [p0++] = r0;
    jump fill;
filled:
    rts;

    .text
/* An interrupt: all that C may change is kept. */
interrupt:
    [--sp] = astat;
    [--sp] = rets;
    [--sp] = (r7:0, p5:0);
    [--sp] = fp;
    [--sp] = i0;
    [--sp] = i1;
    [--sp] = i2;
    [--sp] = i3;
    [--sp] = m0;
    [--sp] = m1;
    [--sp] = m2;
    [--sp] = m3;
    [--sp] = b0;
    [--sp] = b1;
    [--sp] = b2;
    [--sp] = b3;
    [--sp] = l0;
    [--sp] = l1;
    [--sp] = l2;
    [--sp] = l3;
    [--sp] = a0.x;
    [--sp] = a0.w;
    [--sp] = a1.x;
    [--sp] = a1.w;
    [--sp] = lc0;
    [--sp] = lc1;
    [--sp] = lt0;
    [--sp] = lt1;
    [--sp] = lb0;
    [--sp] = lb1;
    l0 = 0;
    l1 = 0;
    l2 = 0;
    l3 = 0;
    sp += -12;
    call _bf537_interrupt;
    sp += 12;
    lb1 = [sp++];
    lb0 = [sp++];
    lt1 = [sp++];
    lt0 = [sp++];
    lc1 = [sp++];
    lc0 = [sp++];
    a1.w = [sp++];
    a1.x = [sp++];
    a0.w = [sp++];
    a0.x = [sp++];
    l3 = [sp++];
    l2 = [sp++];
    l1 = [sp++];
    l0 = [sp++];
    b3 = [sp++];
    b2 = [sp++];
    b1 = [sp++];
    b0 = [sp++];
    m3 = [sp++];
    m2 = [sp++];
    m1 = [sp++];
    m0 = [sp++];
    i3 = [sp++];
    i2 = [sp++];
    i1 = [sp++];
    i0 = [sp++];
    fp = [sp++];
    (r7:0, p5:0) = [sp++];
    rets = [sp++];
    astat = [sp++];
    rti;

/* A fault ends the program: its registers go into a record, and the report is written on a stack of its
 * own, as the stack may be the cause. */
fault:
    usp = p0;
    p0 = sp;
    sp.l = _bf537_fault_stack_end;
    sp.h = _bf537_fault_stack_end;
    [--sp] = p0;
    p0 = usp;
    [--sp] = reti;
    [--sp] = retx;
    [--sp] = rets;
    [--sp] = fp;
    [--sp] = (r7:0, p5:0);
    r0 = sp;
    r1 = seqstat;
    l0 = 0;
    l1 = 0;
    l2 = 0;
    l3 = 0;
    sp += -12;
    call _bf537_fault;
    jump.l halt;
