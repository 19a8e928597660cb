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
    /// Real time per answer: rendering an image of three million pixels takes seconds.
    SIM_CONNECTION_TIMEOUT_MS = 120000,
    SIM_STARTING_MS = 500,  ///< a daemon that starts looks for its rig that long
    SIM_CONNECTION_TEXT = 200,
};

/// A connection. The caller owns it; one thread at a time. All backends of a rig share one.
struct sim_connection {
    int socket;  ///< not connected, or the rig has gone
    bool wall;   ///< the rig runs in real time
    bool met;    ///< a rig has answered: `wall` is known
    /// Real time only: the last answer was that idle work is due, so the next one is that it is
    /// not.
    bool idled;
    int timeout_ms;
    uint16_t tag;
    uint64_t now_us;                 ///< latest time reported by the rig
    uint64_t ahead_us;               ///< offset of `now_us` ahead of the rig's own time
    char text[SIM_CONNECTION_TEXT];  ///< one line: the last error
};

/// One request and its reply.
struct sim_exchange {
    uint16_t type;  ///< SIMRIG_*
    const void *body;
    size_t bytes;
    /// Status of the reply, SIMRIG_*; the fields below are filled if it carries data.
    int32_t status;
    uint8_t *head;  ///< receives the first bytes of the reply: exactly `head_bytes`
    size_t head_bytes;
    uint8_t *rest;  ///< receives the following bytes; excess is dropped
    size_t rest_capacity;
    size_t rest_bytes;  ///< bytes received
};

/// How long to wait for a rig that starts: it listens at once, and answers once its scene is
/// prepared.
struct sim_wait {
    int listener_ms;  ///< time limit until something listens at the address
    int answer_ms;    ///< time limit from then on until the rig answers
    /// Called about twenty times a second with the time waited; false: give up. May be NULL.
    bool (*go_on)(void *self, int64_t waited_ms);
    void *self;
};

/// Connects to `where` (unix:PATH or tcp:HOST:PORT) in a role (SIMRIG_ROLE_*) and greets.
/// `timeout_ms` limits the real time of this and every later exchange. 0; ERROR_ARGUMENT: `where`
/// is neither form; ERROR_MISSING: nothing listens there; ERROR_TIMEOUT: no answer; ERROR_IO: no
/// rig, or no connection; ERROR_VERSION, ERROR_REFUSED: another version, or the rig already has a
/// board. `text` has the details.
int sim_connection_open(struct sim_connection *self, const char *where, uint16_t role,
                        int timeout_ms);
void sim_connection_close(struct sim_connection *self);

/// Whether the rig has gone, as far as can be seen without a request.
bool sim_connection_gone(struct sim_connection *self);

/// Reconnects after the rig has gone, to the same or another rig, whose time continues from
/// `now_us`. Otherwise as sim_connection_open, with these limits; ERROR_REFUSED also if the rig's
/// kind of time differs, ERROR_CANCELLED: `wait` gave up.
int sim_connection_renew(struct sim_connection *self, const char *where, uint16_t role,
                         const struct sim_wait *wait);

/// Converts a time from the protocol (8 bytes), and a time to send.
uint64_t sim_connection_reported_us(const struct sim_connection *self, const uint8_t *bytes);
void sim_connection_put_us(const struct sim_connection *self, uint8_t *bytes, uint64_t time_us);

/// Sends the request and receives the reply. 0 whatever the reply's status; the text of a rejection
/// is in `text`. ERROR_DEVICE: the rig has gone, or violates the protocol; permanent until
/// sim_connection_renew. Repeated within the time limit while another client advances the time.
int sim_connection_run(struct sim_connection *self, struct sim_exchange *exchange);

/// The same for a request whose status must be SIMRIG_OK; ERROR_IO otherwise.
int sim_connection_require(struct sim_connection *self, struct sim_exchange *exchange);

/// Reads the time into `now_us`. Errors as above.
int sim_connection_ask_time(struct sim_connection *self);

/// Advances the time to `until_us`, or until an event of `wake` (SIMRIG_WAKE_*). `*woken` (may be
/// NULL): the event. If the rig has gone, the time is reached: ERROR_DEVICE.
int sim_connection_advance(struct sim_connection *self, uint64_t until_us, uint32_t wake,
                           uint32_t *woken);

/// Runs a command of the rig's control side ("fault camera left unplug"). ERROR_REFUSED: it failed,
/// `text` has the reason. `answer` (may be NULL) receives the answer, truncated to fit and
/// terminated.
int sim_connection_control(struct sim_connection *self, const char *command, char *answer,
                           size_t capacity);

#ifdef __cplusplus
}
#endif

#endif
