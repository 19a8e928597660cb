// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/sim/sim_connection.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/sim/sim_bytes.h"
#include "daemon/backends/sim/sim_socket.h"
#include "daemon/base/monotonic.h"

enum {
    STATUS_BYTES = 4,
    HELLO_BYTES = 8,
    REPLY_HELLO_BYTES = 4,
    BUSY_PAUSE_NS = 1000000,
    POLL_MS = 50,
};

// The rig rejects more than a day.
static const uint64_t longest_us = 12 * UINT64_C(3600000000);

__attribute__((format(printf, 2, 3))) static void report(struct sim_connection *self,
                                                         const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(self->text, sizeof self->text, format, arguments);
    va_end(arguments);
}

void sim_connection_close(struct sim_connection *self) {
    if (self->socket >= 0) {
        close(self->socket);
    }
    self->socket = -1;
}

// Closes the connection and records why.
static int give_up(struct sim_connection *self, int error, const char *doing) {
    if (error == ERROR_TIMEOUT) {
        report(self, "no answer from the simulated rig for %d s while %s",
               (self->timeout_ms + 500) / 1000, doing);
    } else if (error == ERROR_SYNTAX) {
        report(self, "not a simulated rig, or another version (%s)", doing);
    } else {
        report(self, "the simulated rig has gone (%s): start it, then run bringup", doing);
    }
    sim_connection_close(self);
    return ERROR_DEVICE;
}

static int discard(struct sim_connection *self, size_t bytes, int64_t deadline_ms) {
    uint8_t nothing[256];
    int error = ERROR_OK;
    while (bytes > 0 && error == ERROR_OK) {
        const size_t part = bytes < sizeof nothing ? bytes : sizeof nothing;
        error = sim_socket_receive(self->socket, nothing, part, deadline_ms);
        bytes -= part;
    }
    return error;
}

static bool has_data(const struct sim_exchange *exchange) {
    return exchange->status == SIMRIG_OK ||
           (exchange->type == SIMRIG_I2C && exchange->status <= SIMRIG_I2C_NACK_ADDRESS &&
            exchange->status >= SIMRIG_I2C_STUCK);
}

// Receives the body of a reply after the status.
static int receive_data(struct sim_connection *self, struct sim_exchange *exchange, size_t bytes,
                        int64_t deadline_ms) {
    if (bytes < exchange->head_bytes) {
        return ERROR_SYNTAX;
    }
    int error = sim_socket_receive(self->socket, exchange->head, exchange->head_bytes, deadline_ms);
    bytes -= exchange->head_bytes;
    exchange->rest_bytes = bytes < exchange->rest_capacity ? bytes : exchange->rest_capacity;
    if (error == ERROR_OK) {
        error = sim_socket_receive(self->socket, exchange->rest, exchange->rest_bytes, deadline_ms);
    }
    return error == ERROR_OK ? discard(self, bytes - exchange->rest_bytes, deadline_ms) : error;
}

static int receive_text(struct sim_connection *self, size_t bytes, int64_t deadline_ms) {
    const size_t kept = bytes < sizeof self->text - 1 ? bytes : sizeof self->text - 1;
    const int error = sim_socket_receive(self->socket, self->text, kept, deadline_ms);
    self->text[kept] = '\0';
    // The text may come from any server: keep one printable line.
    for (size_t i = 0; i < kept; i++) {
        const unsigned char c = (unsigned char)self->text[i];
        self->text[i] = c < ' ' || c == 0x7F ? '?' : self->text[i];
    }
    if (kept == 0) {
        report(self, "refused by the simulated rig, without a reason");
    }
    return error == ERROR_OK ? discard(self, bytes - kept, deadline_ms) : error;
}

static int receive(struct sim_connection *self, struct sim_exchange *exchange,
                   int64_t deadline_ms) {
    uint8_t head[SIMRIG_HEADER_BYTES + STATUS_BYTES];
    int error = sim_socket_receive(self->socket, head, sizeof head, deadline_ms);
    if (error != ERROR_OK) {
        return error;
    }
    const size_t bytes = sim_bytes_u32(head);
    if (bytes < STATUS_BYTES || bytes > SIMRIG_BODY_MAX ||
        sim_bytes_u16(head + 4) != (exchange->type | SIMRIG_REPLY) ||
        sim_bytes_u16(head + 6) != self->tag) {
        return ERROR_SYNTAX;
    }
    exchange->status = (int32_t)sim_bytes_u32(head + SIMRIG_HEADER_BYTES);
    return has_data(exchange) ? receive_data(self, exchange, bytes - STATUS_BYTES, deadline_ms)
                              : receive_text(self, bytes - STATUS_BYTES, deadline_ms);
}

static int send_request(struct sim_connection *self, struct sim_exchange *exchange,
                        int64_t deadline_ms) {
    uint8_t head[SIMRIG_HEADER_BYTES];
    sim_bytes_put_u32(head, (uint32_t)exchange->bytes);
    sim_bytes_put_u16(head + 4, exchange->type);
    sim_bytes_put_u16(head + 6, ++self->tag);
    exchange->rest_bytes = 0;
    const int error = sim_socket_send(self->socket, head, sizeof head, deadline_ms);
    return error == ERROR_OK
               ? sim_socket_send(self->socket, exchange->body, exchange->bytes, deadline_ms)
               : error;
}

static int run_once(struct sim_connection *self, struct sim_exchange *exchange,
                    int64_t deadline_ms) {
    const int error = send_request(self, exchange, deadline_ms);
    return error == ERROR_OK ? receive(self, exchange, deadline_ms) : error;
}

int sim_connection_run(struct sim_connection *self, struct sim_exchange *exchange) {
    INVARIANT(exchange->bytes <= SIMRIG_BODY_MAX);
    INVARIANT(exchange->head != NULL || exchange->head_bytes == 0);
    const int64_t deadline_ms = monotonic_now_ms() + self->timeout_ms;
    for (;;) {
        if (self->socket < 0) {
            return ERROR_DEVICE;
        }
        const int error = run_once(self, exchange, deadline_ms);
        if (error != ERROR_OK) {
            return give_up(self, error, exchange->type == SIMRIG_HELLO ? "greeting" : "at work");
        }
        if (exchange->status != SIMRIG_BUSY || exchange->type == SIMRIG_HELLO) {
            return ERROR_OK;
        }
        if (monotonic_now_ms() >= deadline_ms) {
            return give_up(self, ERROR_TIMEOUT, "another client advances the time");
        }
        nanosleep(&(struct timespec){.tv_nsec = BUSY_PAUSE_NS}, NULL);
    }
}

int sim_connection_require(struct sim_connection *self, struct sim_exchange *exchange) {
    const int error = sim_connection_run(self, exchange);
    return error == ERROR_OK && exchange->status != SIMRIG_OK ? ERROR_IO : error;
}

static bool may_go_on(const struct sim_wait *wait, int64_t since_ms) {
    return wait->go_on == NULL || wait->go_on(wait->self, monotonic_now_ms() - since_ms);
}

static int await_answer(const struct sim_connection *self, const struct sim_wait *wait,
                        int64_t since_ms, int64_t deadline_ms) {
    struct pollfd polled = {.fd = self->socket, .events = POLLIN};
    while (poll(&polled, 1, POLL_MS) <= 0) {
        if (!may_go_on(wait, since_ms)) {
            return ERROR_CANCELLED;
        }
        if (monotonic_now_ms() >= deadline_ms) {
            return ERROR_TIMEOUT;
        }
    }
    return ERROR_OK;
}

static int greet(struct sim_connection *self, uint16_t role, const struct sim_wait *wait,
                 int64_t since_ms) {
    static const char name[] = "vergence";
    uint8_t body[HELLO_BYTES + sizeof name - 1], head[REPLY_HELLO_BYTES];
    sim_bytes_put_u32(body, SIMRIG_MAGIC);
    sim_bytes_put_u16(body + 4, SIMRIG_VERSION);
    sim_bytes_put_u16(body + 6, role);
    memcpy(body + HELLO_BYTES, name, sizeof name - 1);
    struct sim_exchange hello = {.type = SIMRIG_HELLO,
                                 .body = body,
                                 .bytes = sizeof body,
                                 .head = head,
                                 .head_bytes = sizeof head};
    const int64_t deadline_ms = monotonic_now_ms() + wait->answer_ms;
    int error = send_request(self, &hello, deadline_ms);
    error = error == ERROR_OK ? await_answer(self, wait, since_ms, deadline_ms) : error;
    error = error == ERROR_OK ? receive(self, &hello, deadline_ms) : error;
    if (error != ERROR_OK) {
        self->timeout_ms = wait->answer_ms;
        give_up(self, error, "greeting");
        return error == ERROR_TIMEOUT || error == ERROR_CANCELLED ? error : ERROR_IO;
    }
    if (hello.status != SIMRIG_OK) {
        sim_connection_close(self);
        return hello.status == SIMRIG_BAD_VERSION ? ERROR_VERSION : ERROR_REFUSED;
    }
    self->wall = sim_bytes_u16(head + 2) != 0;
    self->met = true;
    return ERROR_OK;
}

/// Whether a rig that starts may listen there: not in a directory that does not exist.
static bool may_appear(const char *where) {
    char folder[sizeof((struct sockaddr_un *)0)->sun_path + 1];
    if (strncmp(where, "unix:", 5) != 0 || strlen(where + 5) >= sizeof folder) {
        return true;
    }
    strcpy(folder, where + 5);
    char *slash = strrchr(folder, '/');
    if (slash == NULL) {
        return true;
    }
    slash[1] = '\0';
    return access(folder, F_OK) == 0;
}

/// Connects as soon as something listens there. The socket, or an error of sim_socket_connect, or
/// ERROR_MISSING or ERROR_CANCELLED.
static int connect_to_starting(const char *where, const struct sim_wait *wait, int64_t since_ms) {
    for (;;) {
        const int made = sim_socket_connect(where, monotonic_now_ms() + wait->answer_ms);
        if (made != ERROR_IO || (errno != ENOENT && errno != ECONNREFUSED)) {
            return made;
        }
        const int why = errno;
        if (!may_appear(where)) {
            errno = why;
            return ERROR_IO;
        }
        if (!may_go_on(wait, since_ms)) {
            errno = why;
            return ERROR_CANCELLED;
        }
        if (monotonic_now_ms() - since_ms >= wait->listener_ms) {
            errno = why;
            return ERROR_MISSING;
        }
        nanosleep(&(struct timespec){.tv_nsec = POLL_MS * 1000000L}, NULL);
    }
}

static const char *explain_failure(int error) {
    if (error == ERROR_TIMEOUT) {
        return "no answer";
    }
    return errno == 0 ? "no such host" : strerror(errno);
}

static int open_waiting(struct sim_connection *self, const char *where, uint16_t role,
                        int timeout_ms, const struct sim_wait *wait) {
    INVARIANT(role == SIMRIG_ROLE_BOARD || role == SIMRIG_ROLE_CONTROL);
    INVARIANT(timeout_ms > 0 && wait->answer_ms > 0);
    const int64_t since_ms = monotonic_now_ms();
    *self = (struct sim_connection){.socket = -1, .timeout_ms = timeout_ms};
    const int made = connect_to_starting(where, wait, since_ms);
    if (made == ERROR_ARGUMENT) {
        report(self,
               "invalid address '%s' of a simulated rig (expected unix:PATH or tcp:HOST:PORT)",
               where);
        return ERROR_ARGUMENT;
    }
    if (made < 0) {
        report(self, "no simulated rig at %s: %s (is simrig running?)", where,
               explain_failure(made));
        return made;
    }
    self->socket = made;
    const int error = greet(self, role, wait, since_ms);
    self->timeout_ms = timeout_ms;
    return error;
}

int sim_connection_open(struct sim_connection *self, const char *where, uint16_t role,
                        int timeout_ms) {
    return open_waiting(self, where, role, timeout_ms, &(struct sim_wait){.answer_ms = timeout_ms});
}

bool sim_connection_gone(struct sim_connection *self) {
    if (self->socket >= 0 && sim_socket_has_ended(self->socket)) {
        give_up(self, ERROR_IO, "at rest");
    }
    return self->socket < 0;
}

uint64_t sim_connection_reported_us(const struct sim_connection *self, const uint8_t *bytes) {
    return sim_bytes_u64(bytes) + self->ahead_us;
}

void sim_connection_put_us(const struct sim_connection *self, uint8_t *bytes, uint64_t time_us) {
    sim_bytes_put_u64(bytes, time_us > self->ahead_us ? time_us - self->ahead_us : 0);
}

int sim_connection_ask_time(struct sim_connection *self) {
    uint8_t head[8];
    struct sim_exchange ask = {.type = SIMRIG_TIME, .head = head, .head_bytes = sizeof head};
    const int error = sim_connection_require(self, &ask);
    if (error == ERROR_OK) {
        self->now_us = sim_connection_reported_us(self, head);
    }
    return error;
}

int sim_connection_renew(struct sim_connection *self, const char *where, uint16_t role,
                         const struct sim_wait *wait) {
    const struct sim_connection before = *self;
    sim_connection_close(self);
    int error = open_waiting(self, where, role, before.timeout_ms, wait);
    if (error == ERROR_OK) {
        error = sim_connection_ask_time(self);
    }
    if (error == ERROR_OK && before.met && self->wall != before.wall) {
        report(self,
               "the simulated rig at %s uses another kind of time (real or virtual): restart "
               "vergenced",
               where);
        sim_connection_close(self);
        error = ERROR_REFUSED;
    }
    if (error != ERROR_OK && before.met) {
        self->met = true;
        self->wall = before.wall;
    }
    if (self->now_us < before.now_us) {
        self->ahead_us = before.now_us - self->now_us;
        self->now_us = before.now_us;
    }
    return error;
}

int sim_connection_advance(struct sim_connection *self, uint64_t until_us, uint32_t wake,
                           uint32_t *woken) {
    uint32_t woken_by = 0;
    int error = ERROR_OK;
    do {
        const uint64_t max_us = self->now_us + longest_us;
        uint8_t body[12], head[12];
        sim_connection_put_us(self, body, until_us < max_us ? until_us : max_us);
        sim_bytes_put_u32(body + 8, wake);
        struct sim_exchange advance = {.type = SIMRIG_ADVANCE,
                                       .body = body,
                                       .bytes = sizeof body,
                                       .head = head,
                                       .head_bytes = sizeof head};
        error = sim_connection_require(self, &advance);
        if (error != ERROR_OK) {
            // The rig is gone, so waits are over: let deadlines be reached.
            self->now_us = until_us > self->now_us ? until_us : self->now_us;
            break;
        }
        self->now_us = sim_connection_reported_us(self, head);
        woken_by = sim_bytes_u32(head + 8);
    } while (woken_by == 0 && self->now_us < until_us);
    if (woken != NULL) {
        *woken = woken_by;
    }
    return error;
}

int sim_connection_control(struct sim_connection *self, const char *command, char *answer,
                           size_t capacity) {
    INVARIANT(answer == NULL || capacity > 0);
    struct sim_exchange control = {.type = SIMRIG_CONTROL,
                                   .body = command,
                                   .bytes = strlen(command),
                                   .rest = (uint8_t *)answer,
                                   .rest_capacity = answer != NULL ? capacity - 1 : 0};
    const int error = sim_connection_run(self, &control);
    if (error == ERROR_OK && answer != NULL) {
        answer[control.rest_bytes] = '\0';
    }
    return error == ERROR_OK && control.status != SIMRIG_OK ? ERROR_REFUSED : error;
}
