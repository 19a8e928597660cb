/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The simulated rig (tools/simrig) as the devices of the simulated processor see it. Its time is
 * that of the processor's cycles. */
#ifndef RIG_CLIENT_H
#define RIG_CLIENT_H

#include <stddef.h>
#include <stdint.h>

enum { RIG_CYCLES_PER_US = 600 };

/* A request (SIMRIG_*) and its reply, for rig_ask. */
struct rig_request {
    uint16_t type;
    const void *body;
    size_t bytes;
    int32_t status; /* SIMRIG_OK or an error */
    uint8_t *reply; /* what follows the status; owned by the client, until the next request */
    size_t reply_bytes;
};

/* Advances the rig to the time of `cycles`, unless it is ahead, then runs a request. Without a rig
 * (the environment has no VERGENCE_SIMRIG) nothing is connected: SIMRIG_FAILED. A rig that is gone
 * ends the simulator with a message. */
void rig_ask(int64_t cycles, struct rig_request *request);

/* The rig's time as cycles, which a transfer on the bus takes further than that of its request. */
int64_t rig_time(void);

void rig_put_u16(uint8_t *to, unsigned value);
void rig_put_u32(uint8_t *to, uint32_t value);
void rig_put_u64(uint8_t *to, uint64_t value);
uint16_t rig_u16(const uint8_t *from);
uint32_t rig_u32(const uint8_t *from);
uint64_t rig_u64(const uint8_t *from);

#endif
