// SPDX-License-Identifier: Apache-2.0
/// A connection to a simulated rig: requests and replies of tools/simrig/protocol.
#ifndef VERGENCE_DAEMON_BACKENDS_SIM_SIM_CONNECTION_H
#define VERGENCE_DAEMON_BACKENDS_SIM_SIM_CONNECTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "tools/simrig/protocol/simrig_protocol.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    /// Real time for one answer: a picture of three million pixels takes seconds to be rendered.
    SIM_CONNECTION_PATIENCE_MS = 120000,
    SIM_CONNECTION_TEXT = 200,
};

/// A connection. The caller owns it; one thread at a time. All backends of a rig share one.
struct sim_connection {
    int socket;  ///< -1: the rig has gone, or was never there
    bool wall;   ///< the rig keeps up with the clock of the machine
    int patience_ms;
    uint16_t tag;
    uint64_t now_us;                 ///< the newest time that the rig has told
    uint64_t ahead_us;               ///< so much is `now_us` ahead of the rig's own time
    char text[SIM_CONNECTION_TEXT];  ///< one line: what was wrong last
};

/// One request and its reply.
struct sim_exchange {
    uint16_t type;  ///< SIMRIG_*
    const void *body;
    size_t bytes;
    int32_t status;  ///< of the reply: SIMRIG_*; the rest is filled when it comes with data
    uint8_t *head;   ///< the reply's first bytes go here: exactly so many must come
    size_t head_bytes;
    uint8_t *rest;  ///< and those after them here; what is more than fits is lost
    size_t rest_capacity;
    size_t rest_bytes;  ///< that came
};

/// Connects to `where` (unix:PATH or tcp:HOST:PORT) in a role (SIMRIG_ROLE_*) and greets.
/// `patience_ms` of real time is the most that this and every later exchange may take. 0;
/// ERROR_ARGUMENT: `where` is neither; ERROR_IO: nobody listens there, or in vain; ERROR_VERSION,
/// ERROR_REFUSED: the rig speaks another version, or has a board already. `text` says more.
int sim_connection_open(struct sim_connection *self, const char *where, uint16_t role,
                        int patience_ms);
void sim_connection_close(struct sim_connection *self);

/// Whether the rig has gone, as far as that shows without asking it.
bool sim_connection_gone(struct sim_connection *self);

/// Connects anew after the rig has gone: to the same one or another, whose time goes on from
/// `now_us`. Otherwise as sim_connection_open, but it waits for 2 s at most; ERROR_REFUSED also for
/// a rig that keeps another kind of time.
int sim_connection_renew(struct sim_connection *self, const char *where, uint16_t role);

/// A time that the rig has told (8 bytes of the protocol), and one for it to be told.
uint64_t sim_connection_told_us(const struct sim_connection *self, const uint8_t *bytes);
void sim_connection_put_us(const struct sim_connection *self, uint8_t *bytes, uint64_t time_us);

/// Sends the request and takes the reply. 0: whatever its status; the text of a refusal is in
/// `text`. ERROR_DEVICE: the rig has gone, or does not follow the protocol; from then on always,
/// until sim_connection_renew.
/// While another client lets time pass it is asked again, within the patience.
int sim_connection_run(struct sim_connection *self, struct sim_exchange *exchange);

/// The same for a request whose status must be SIMRIG_OK; ERROR_IO when it is another.
int sim_connection_demand(struct sim_connection *self, struct sim_exchange *exchange);

/// Asks for the time: `now_us` is it then. Errors as above.
int sim_connection_ask_time(struct sim_connection *self);

/// Lets time pass until `until_us`, or until something of `wake` (SIMRIG_WAKE_*) is there.
/// `*woken` (may be NULL): what it was. When the rig has gone, its time has come: ERROR_DEVICE.
int sim_connection_advance(struct sim_connection *self, uint64_t until_us, uint32_t wake,
                           uint32_t *woken);

/// A command of the rig's control side ("fault camera left unplug"). ERROR_REFUSED: it did not
/// work, `text` says why. `answer` (may be NULL) holds the answer, cut to fit, with an end.
int sim_connection_control(struct sim_connection *self, const char *command, char *answer,
                           size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
