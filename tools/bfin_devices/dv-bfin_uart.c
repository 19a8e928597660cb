/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The UARTs of the BF537: the first is the simulator's own model, on standard input and output or a
 * socket; the second is the simulated rig's serial line to the lens controller.  */
/* The simulator's headers need this order.  */
// clang-format off
#include "defs.h"
#include "sim-main.h"
#include "devices.h"
#include "hw-main.h"
// clang-format on

/* The simulator's own model looks for a byte every 10,000 cycles, which ends each sleep of the
   processor: here every 167 us, the time of a byte at 57600 baud.  */
static struct hw_event *schedule_rarely(struct hw *me, int64_t cycles, hw_event_callback *callback,
                                        void *data) {
    return hw_event_queue_schedule(me, 10 * cycles, callback, data);
}

#define hw_event_queue_schedule schedule_rarely
#define dv_bfin_uart_descriptor stock_bfin_uart_descriptor
#include "bfin/dv-bfin_uart.c"
#undef dv_bfin_uart_descriptor
#undef hw_event_queue_schedule

#include "rig_client.h"
#include "simrig_protocol.h"

enum { UART1_BASE = 0xFFC02000, LOOK_CYCLES = 500 * RIG_CYCLES_PER_US };

static struct {
    uint8_t bytes[SIMRIG_SERIAL_BYTES_MAX];
    size_t received, taken;
    int64_t next_look;
} line;

static bool has_byte(struct hw *me) {
    struct rig_request request = {.type = SIMRIG_SERIAL_READ};
    int64_t now = hw_event_queue_time(me);
    if (line.taken < line.received)
        return true;
    if (now < line.next_look)
        return false;
    line.next_look = now + LOOK_CYCLES;
    rig_ask(now, &request);
    if (request.status != SIMRIG_OK)
        return false;
    line.taken = 0;
    line.received =
        request.reply_bytes < sizeof line.bytes ? request.reply_bytes : sizeof line.bytes;
    memcpy(line.bytes, request.reply, line.received);
    return line.received > 0;
}

static void poll_line(struct hw *me, void *data) {
    struct bfin_uart *uart = data;
    uart->handler = NULL;
    if (has_byte(me))
        hw_port_event(me, DV_PORT_RX, 1);
    if (uart->ier & ERBFI)
        uart->handler = hw_event_queue_schedule(me, LOOK_CYCLES, poll_line, uart);
}

static unsigned uart_write(struct hw *me, const void *source, int space, address_word addr,
                           unsigned nr_bytes) {
    struct bfin_uart *uart = hw_data(me);
    uint8_t byte = dv_load_2(source);
    bu32 offset = addr - uart->base;
    bool latched = uart->lcr & DLAB;
    if (uart->base != UART1_BASE || latched ||
        (offset != mmr_offset(dll) && offset != mmr_offset(dlh)))
        return bfin_uart_io_write_buffer(me, source, space, addr, nr_bytes);
    if (offset == mmr_offset(dlh)) {
        uart->ier = byte;
        if ((byte & ERBFI) && uart->handler == NULL)
            uart->handler = hw_event_queue_schedule(me, LOOK_CYCLES, poll_line, uart);
        return nr_bytes;
    }
    struct rig_request request = {.type = SIMRIG_SERIAL_WRITE, .body = &byte, .bytes = 1};
    rig_ask(hw_event_queue_time(me), &request);
    return nr_bytes;
}

static unsigned uart_read(struct hw *me, void *dest, int space, address_word addr,
                          unsigned nr_bytes) {
    struct bfin_uart *uart = hw_data(me);
    bu32 offset = addr - uart->base;
    if (uart->base != UART1_BASE || (uart->lcr & DLAB))
        return bfin_uart_io_read_buffer(me, dest, space, addr, nr_bytes);
    switch (offset) {
        case mmr_offset(dll):
            dv_store_2(dest, has_byte(me) ? line.bytes[line.taken++] : 0);
            return nr_bytes;
        case mmr_offset(lsr):
            dv_store_2(dest, TEMT | THRE | (has_byte(me) ? DR : 0));
            return nr_bytes;
        default:
            return bfin_uart_io_read_buffer(me, dest, space, addr, nr_bytes);
    }
}

static void uart_finish(struct hw *me) {
    bfin_uart_finish(me);
    set_hw_io_read_buffer(me, uart_read);
    set_hw_io_write_buffer(me, uart_write);
}

const struct hw_descriptor dv_bfin_uart_descriptor[] = {
    {
        "bfin_uart",
        uart_finish,
    },
    {NULL, NULL},
};
