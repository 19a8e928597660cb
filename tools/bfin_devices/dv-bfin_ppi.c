/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The parallel port of the BF537 behind the simulated rig's bridge: the frame that the bridge lets
 * through goes to the DMA channel when its last pixel has arrived.  */
#define dv_bfin_ppi_descriptor stock_bfin_ppi_descriptor
#include "bfin/dv-bfin_ppi.c"
#undef dv_bfin_ppi_descriptor

#include <stdlib.h>

#include "rig_client.h"
#include "simrig_protocol.h"

enum { LOOK_CYCLES = 200 * RIG_CYCLES_PER_US, HEAD_BYTES = 28 };

static struct {
    bool armed;
    int64_t next_look;
    uint8_t *frame;
    size_t bytes, taken;
} port;

static void drop_frame(void) {
    free(port.frame);
    port.frame = NULL;
    port.bytes = port.taken = 0;
}

static void arm(struct hw *me, struct bfin_ppi *ppi) {
    uint8_t body[4];
    struct rig_request request = {.type = SIMRIG_FRAME_ARM, .body = body, .bytes = sizeof body};
    rig_put_u16(body, ppi->count + 1);
    rig_put_u16(body + 2, ppi->frame);
    drop_frame();
    rig_ask(hw_event_queue_time(me), &request);
    port.armed = request.status == SIMRIG_OK;
    port.next_look = 0;
}

static void disarm(struct hw *me) {
    struct rig_request request = {.type = SIMRIG_FRAME_CANCEL};
    drop_frame();
    if (port.armed)
        rig_ask(hw_event_queue_time(me), &request);
    port.armed = false;
}

/* Fetches the armed frame if it is complete.  */
static void look(struct hw *me, struct bfin_ppi *ppi) {
    int64_t now = hw_event_queue_time(me);
    uint8_t body[8];
    struct rig_request request = {.type = SIMRIG_FRAME_WAIT, .body = body, .bytes = sizeof body};
    if (!port.armed || now < port.next_look)
        return;
    port.next_look = now + LOOK_CYCLES;
    rig_put_u64(body, now / RIG_CYCLES_PER_US);
    rig_ask(now, &request);
    if (request.status != SIMRIG_OK)
        return;
    port.armed = false;
    uint32_t faults = rig_u32(request.reply + 24);
    ppi->status |= (faults & SIMRIG_FRAME_SHORT_LINE ? 0x200 : 0) |
                   (faults & SIMRIG_FRAME_LONG ? 0x100 : 0) |
                   (faults & SIMRIG_FRAME_SHORT ? 0x800 : 0);
    port.bytes = request.reply_bytes - HEAD_BYTES;
    port.frame = request.reply_bytes > HEAD_BYTES ? malloc(port.bytes) : NULL;
    if (port.frame == NULL)
        hw_abort(me, "no memory for a frame of the rig, or none in its answer");
    memcpy(port.frame, request.reply + HEAD_BYTES, port.bytes);
}

static unsigned ppi_write(struct hw *me, const void *source, int space, address_word addr,
                          unsigned nr_bytes) {
    struct bfin_ppi *ppi = hw_data(me);
    bool was = ppi->control & PORT_EN;
    unsigned done = bfin_ppi_io_write_buffer(me, source, space, addr, nr_bytes);
    bool is = ppi->control & PORT_EN;
    if (addr - ppi->base == mmr_offset(control) && was != is && !(ppi->control & PORT_DIR)) {
        if (is)
            arm(me, ppi);
        else
            disarm(me);
    }
    return done;
}

static unsigned ppi_dma_read(struct hw *me, void *dest, int space, unsigned_word addr,
                             unsigned nr_bytes) {
    struct bfin_ppi *ppi = hw_data(me);
    if (port.frame == NULL)
        look(me, ppi);
    if (port.frame == NULL)
        return 0;
    size_t left = port.bytes - port.taken;
    size_t part = nr_bytes < left ? nr_bytes : left;
    memcpy(dest, port.frame + port.taken, part);
    port.taken += part;
    if (port.taken == port.bytes)
        drop_frame();
    return part;
}

static void ppi_finish(struct hw *me) {
    bfin_ppi_finish(me);
    set_hw_io_write_buffer(me, ppi_write);
    set_hw_dma_read_buffer(me, ppi_dma_read);
}

const struct hw_descriptor dv_bfin_ppi_descriptor[] = {
    {
        "bfin_ppi",
        ppi_finish,
    },
    {NULL, NULL},
};
