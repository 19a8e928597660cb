/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The two-wire interface of the BF537 as a master on the simulated rig's bus. The simulator's own
 * model has the registers and completes nothing; this one runs a transfer when its last message is
 * known, and reports the end when the rig's bus has carried it. A repeated start after a read is a
 * stop and a start.  */
#define dv_bfin_twi_descriptor stock_bfin_twi_descriptor
#include "bfin/dv-bfin_twi.c"
#undef dv_bfin_twi_descriptor

#include "rig_client.c"  // here once: the simulator links one object a device
#include "simrig_protocol.h"

enum {
    MASTER_ENABLE = 1,
    MASTER_READS = 4,
    MASTER_FAST = 8,
    MASTER_STOPS = 0x10,
    MASTER_RESTARTS = 0x20,
    PULLS_SDA = 0x4000,
    PULLS_SCL = 0x8000,
    EVENT_COMPLETE = 0x10,
    EVENT_ERROR = 0x20,
    RECEIVED_ONE = 1 << 2,
    RECEIVED_MORE = 3 << 2,
    HEAD_BYTES = 6,
    MESSAGE_HEAD_BYTES = 4,
};

/* One interface: the BF537 has no second one.  */
static struct {
    uint8_t body[8192]; /* the request for the rig as far as it is known */
    size_t bytes;
    unsigned messages;
    uint8_t sent[256]; /* of the message in progress */
    unsigned sent_bytes, wanted_bytes;
    bool writes; /* a message waits for bytes */
    uint8_t received[256];
    unsigned received_bytes, taken;
    bu16 events, errors; /* what the end of the transfer will report */
    struct hw_event *end;
} bus;

static void end_transfer(struct hw *me, void *data) {
    struct bfin_twi *twi = data;
    bus.end = NULL;
    twi->int_stat |= bus.events;
    twi->master_stat |= bus.errors;
    hw_port_event(me, 0, (twi->int_stat & twi->int_mask) != 0);
}

static void report_at(struct hw *me, struct bfin_twi *twi, int64_t cycles, bu16 events,
                      bu16 errors) {
    int64_t now = hw_event_queue_time(me);
    bus.events = events;
    bus.errors = errors;
    if (bus.end != NULL)
        hw_event_queue_deschedule(me, bus.end);
    bus.end = hw_event_queue_schedule(me, cycles > now ? cycles - now : 1, end_transfer, twi);
}

static bu16 errors_of(int32_t status) {
    switch (status) {
        case SIMRIG_I2C_NACK_ADDRESS:
            return ANAK;
        case SIMRIG_I2C_NACK_DATA:
            return DNAK;
        default:
            return LOSTARB;
    }
}

static void run_transfer(struct hw *me, struct bfin_twi *twi) {
    struct rig_request request = {.type = SIMRIG_I2C, .body = bus.body, .bytes = bus.bytes};
    rig_put_u32(bus.body, twi->master_ctl & MASTER_FAST ? 400000 : 100000);
    rig_put_u16(bus.body + 4, bus.messages);
    rig_ask(hw_event_queue_time(me), &request);
    if (request.status == SIMRIG_OK) {
        size_t bytes = request.reply_bytes - 4;
        bus.received_bytes = bytes < sizeof bus.received ? bytes : sizeof bus.received;
        memcpy(bus.received, request.reply + 4, bus.received_bytes);
        bus.taken = 0;
    }
    bus.messages = 0;
    if (request.status == SIMRIG_I2C_TIMEOUT)
        return; /* a held clock: the interface waits without end */
    if (request.status == SIMRIG_OK)
        report_at(me, twi, rig_time(), EVENT_COMPLETE, 0);
    else
        report_at(me, twi, rig_time(), EVENT_ERROR, errors_of(request.status));
}

/* Adds a message whose bytes are known, and runs the transfer if it is the last or reads.  */
static void add_message(struct hw *me, struct bfin_twi *twi, bool reads) {
    if (bus.messages == 0)
        bus.bytes = HEAD_BYTES;
    uint8_t *head = bus.body + bus.bytes;
    if (bus.bytes + MESSAGE_HEAD_BYTES + bus.wanted_bytes > sizeof bus.body)
        hw_abort(me, "an I2C transfer of more bytes than this model takes");
    head[0] = twi->master_addr;
    head[1] = reads ? SIMRIG_I2C_READ : 0;
    rig_put_u16(head + 2, bus.wanted_bytes);
    bus.bytes += MESSAGE_HEAD_BYTES;
    if (!reads) {
        memcpy(bus.body + bus.bytes, bus.sent, bus.wanted_bytes);
        bus.bytes += bus.wanted_bytes;
        bus.sent_bytes = 0;
    }
    bus.messages++;
    bus.writes = false;
    if (reads || !(twi->master_ctl & MASTER_RESTARTS))
        run_transfer(me, twi);
    else
        report_at(me, twi, 0, EVENT_COMPLETE, 0);
}

static void step(struct hw *me, struct bfin_twi *twi) {
    if (bus.writes && bus.sent_bytes >= bus.wanted_bytes)
        add_message(me, twi, false);
}

static void control(struct hw *me, struct bfin_twi *twi, bu16 value) {
    twi->master_ctl = value;
    if (!(value & MASTER_ENABLE)) {
        bus.messages = 0;
        bus.writes = false;
        return;
    }
    bus.wanted_bytes = value >> 6 & 0xff;
    bus.writes = !(value & MASTER_READS);
    if (bus.writes)
        step(me, twi);
    else
        add_message(me, twi, true);
}

static unsigned twi_write(struct hw *me, const void *source, int space, address_word addr,
                          unsigned nr_bytes) {
    struct bfin_twi *twi = hw_data(me);
    bu16 value = dv_load_2(source);
    switch (addr - twi->base) {
        case mmr_offset(master_ctl):
            control(me, twi, value);
            return nr_bytes;
        case mmr_offset(xmt_data8):
            if (bus.sent_bytes < sizeof bus.sent)
                bus.sent[bus.sent_bytes++] = value;
            step(me, twi);
            return nr_bytes;
        case mmr_offset(fifo_ctl):
            if (value & 1)
                bus.sent_bytes = 0;
            if (value & 2)
                bus.received_bytes = bus.taken = 0;
            break;
        default:
            break;
    }
    return bfin_twi_io_write_buffer(me, source, space, addr, nr_bytes);
}

static unsigned twi_read(struct hw *me, void *dest, int space, address_word addr,
                         unsigned nr_bytes) {
    struct bfin_twi *twi = hw_data(me);
    unsigned left = bus.end == NULL ? bus.received_bytes - bus.taken : 0;
    switch (addr - twi->base) {
        case mmr_offset(fifo_stat):
            dv_store_2(dest, left == 0 ? 0 : left == 1 ? RECEIVED_ONE : RECEIVED_MORE);
            return nr_bytes;
        case mmr_offset(rcv_data8):
            dv_store_2(dest, left > 0 ? bus.received[bus.taken++] : 0);
            return nr_bytes;
        default:
            return bfin_twi_io_read_buffer(me, dest, space, addr, nr_bytes);
    }
}

static void twi_finish(struct hw *me) {
    bfin_twi_finish(me);
    set_hw_io_read_buffer(me, twi_read);
    set_hw_io_write_buffer(me, twi_write);
}

const struct hw_descriptor dv_bfin_twi_descriptor[] = {
    {
        "bfin_twi",
        twi_finish,
    },
    {NULL, NULL},
};
