/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The ports of the BF537. Two pins of port G go to the simulated rig's bridge: PG10 is its
 * interrupt, PG11 its reset (low: active).  */
#define dv_bfin_gpio_descriptor stock_bfin_gpio_descriptor
#include "bfin/dv-bfin_gpio.c"
#undef dv_bfin_gpio_descriptor

#include "rig_client.h"
#include "simrig_protocol.h"

enum { PORTG_BASE = 0xFFC01500, PIN_IRQ = 10, PIN_RESET_N = 11 };

/* The levels that a write to one of the four registers of them asks for. */
static bool levels_of(struct bfin_gpio *port, address_word offset, bu16 value, bu16 *levels) {
    switch (offset) {
        case mmr_offset(data):
            *levels = value;
            return true;
        case mmr_offset(clear):
            *levels = port->data & ~value;
            return true;
        case mmr_offset(set):
            *levels = port->data | value;
            return true;
        case mmr_offset(toggle):
            *levels = port->data ^ value;
            return true;
        default:
            return false;
    }
}

static unsigned gpio_write(struct hw *me, const void *source, int space, address_word addr,
                           unsigned nr_bytes) {
    struct bfin_gpio *port = hw_data(me);
    bu16 before = port->data & port->dir, after, levels;
    if (port->base == PORTG_BASE &&
        levels_of(port, addr - port->base, dv_load_2(source), &levels)) {
        port->data = levels;
    } else if (bfin_gpio_io_write_buffer(me, source, space, addr, nr_bytes) == 0) {
        return 0;
    }
    after = port->data & port->dir;
    if (port->base == PORTG_BASE && ((before ^ after) >> PIN_RESET_N & 1) != 0) {
        uint8_t body[4];
        struct rig_request request = {.type = SIMRIG_GPIO_SET, .body = body, .bytes = sizeof body};
        rig_put_u32(body, after >> PIN_RESET_N & 1 ? 0 : SIMRIG_OUT_BRIDGE_RESET);
        rig_ask(hw_event_queue_time(me), &request);
    }
    return nr_bytes;
}

static unsigned gpio_read(struct hw *me, void *dest, int space, address_word addr,
                          unsigned nr_bytes) {
    struct bfin_gpio *port = hw_data(me);
    struct rig_request request = {.type = SIMRIG_GPIO_GET};
    if (port->base == PORTG_BASE && addr == port->base) {
        rig_ask(hw_event_queue_time(me), &request);
        // An event of the pin would end the instruction that reads it.
        if (request.status == SIMRIG_OK && (port->inen >> PIN_IRQ & 1) != 0)
            port->data = (port->data & ~(1 << PIN_IRQ)) |
                         (rig_u32(request.reply) & SIMRIG_IN_IRQ ? 1 << PIN_IRQ : 0);
    }
    return bfin_gpio_io_read_buffer(me, dest, space, addr, nr_bytes);
}

static void gpio_finish(struct hw *me) {
    bfin_gpio_finish(me);
    set_hw_io_read_buffer(me, gpio_read);
    set_hw_io_write_buffer(me, gpio_write);
}

const struct hw_descriptor dv_bfin_gpio_descriptor[] = {
    {
        "bfin_gpio",
        gpio_finish,
    },
    {NULL, NULL},
};
