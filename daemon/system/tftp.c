// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/tftp.h"

#include <arpa/inet.h>
#include <errno.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"

#define PREFIX "tftp:"
#define BLOCK_TEXT "1428"

enum {
    PORT = 69,
    PORT_MAX = 65535,
    READ = 1,
    WRITE,
    DATA,
    ACKNOWLEDGE,
    FAILED,
    OPTIONS,
    NOT_WANTED = 0,  ///< codes of FAILED
    UNKNOWN_SENDER = 5,
    HEADER_BYTES = 4,
    BLOCK_BYTES = 512,       ///< size of a block unless the option blksize sets another
    BLOCK_BYTES_MIN = 8,     ///< smallest value of the option blksize
    BLOCK_BYTES_MAX = 1428,  ///< BLOCK_TEXT; with all headers less than a packet of Ethernet
    TRIES = 6,
    WAIT_MS = 1000,
    TICK_MS = 100,
    PROGRESS_BLOCKS = 32
};

struct transfer {
    const struct tftp_address *address;
    const struct tftp_observer *observer;
    struct message *message;
    int fd;
    struct sockaddr_in peer;
    bool met;        ///< the server has answered, from the port that it uses for this transfer
    uint16_t block;  ///< sent last, or the last one received
    size_t block_bytes;
    uint64_t done, total;  ///< bytes; total 0: not known
    uint8_t out[HEADER_BYTES + BLOCK_BYTES_MAX];
    size_t out_bytes;
    uint8_t in[HEADER_BYTES + BLOCK_BYTES_MAX + 1];
    size_t in_bytes;
};

bool tftp_is_address(const char *word) {
    return strncmp(word, PREFIX, sizeof PREFIX - 1) == 0;
}

int tftp_parse(const char *text, struct tftp_address *address, struct message *message) {
    char host[INET_ADDRSTRLEN] = "";
    struct in_addr parsed = {0};
    unsigned port = PORT;
    int used = 0;
    if (tftp_is_address(text) &&
        sscanf(text, PREFIX "%15[0-9.]%n:%5u%n", host, &used, &port, &used) >= 1 &&
        strlen(text) < TFTP_NAME_BYTES && (text[used] == '/' || text[used] == '\0') && port > 0 &&
        port <= PORT_MAX && inet_pton(AF_INET, host, &parsed) == 1) {
        *address = (struct tftp_address){.host = parsed.s_addr, .port = htons((uint16_t)port)};
        strcpy(address->name, text + used + (text[used] == '/' ? 1 : 0));
        strcpy(address->text, text);
        return ERROR_OK;
    }
    return message_set(message, ERROR_ARGUMENT,
                       "invalid address \"%s\" (expected tftp:HOST/NAME, where HOST is an IPv4 "
                       "address such as 192.0.2.1)",
                       text);
}

// ---- packets

static void put_word(uint8_t *at, unsigned word) {
    at[0] = (uint8_t)(word >> 8);
    at[1] = (uint8_t)word;
}

static unsigned read_word(const uint8_t *at) {
    return (unsigned)at[0] << 8 | at[1];
}

static void begin_packet(struct transfer *self, unsigned kind, unsigned number) {
    put_word(self->out, kind);
    put_word(self->out + 2, number);
    self->out_bytes = HEADER_BYTES;
}

static void add_text(struct transfer *self, const char *text) {
    const size_t bytes = strlen(text) + 1;
    INVARIANT(self->out_bytes + bytes <= sizeof self->out);
    memcpy(self->out + self->out_bytes, text, bytes);
    self->out_bytes += bytes;
}

/// The first packet: the file, and the options of this side.
static void make_request(struct transfer *self, unsigned kind) {
    char total[24];
    snprintf(total, sizeof total, "%" PRIu64, self->total);
    put_word(self->out, kind);
    self->out_bytes = 2;
    add_text(self, self->address->name);
    add_text(self, "octet");
    add_text(self, "blksize");
    add_text(self, BLOCK_TEXT);
    add_text(self, "tsize");
    add_text(self, total);
}

/// A lost packet is sent again, so a failure to send is like a lost one.
static void send_packet(const struct transfer *self, const void *packet, size_t bytes,
                        const struct sockaddr_in *to) {
    const ssize_t sent =
        sendto(self->fd, packet, bytes, 0, (const struct sockaddr *)to, sizeof *to);
    (void)sent;
}

/// Ends the transfer at the server.
static void give_up(struct transfer *self, const char *why) {
    if (self->met) {
        begin_packet(self, FAILED, NOT_WANTED);
        add_text(self, why);
        send_packet(self, self->out, self->out_bytes, &self->peer);
    }
}

/// Whether the packet that was received is of this transfer; the first one has the server's port.
static bool is_ours(struct transfer *self, const struct sockaddr_in *from) {
    static const uint8_t unknown[] = {0, FAILED, 0, UNKNOWN_SENDER, '?', 0};
    if (from->sin_addr.s_addr != self->address->host || self->in_bytes < HEADER_BYTES) {
        return false;
    }
    if (self->met && from->sin_port != self->peer.sin_port) {
        send_packet(self, unknown, sizeof unknown, from);
        return false;
    }
    self->peer.sin_port = from->sin_port;
    self->met = true;
    return true;
}

/// Receives a packet of this transfer, or none until a tick is over.
static bool receive(struct transfer *self) {
    struct pollfd wait = {.fd = self->fd, .events = POLLIN};
    struct sockaddr_in from = {0};
    socklen_t bytes = sizeof from;
    if (poll(&wait, 1, TICK_MS) <= 0) {
        return false;
    }
    const ssize_t received = recvfrom(self->fd, self->in, sizeof self->in - 1, MSG_DONTWAIT,
                                      (struct sockaddr *)&from, &bytes);
    self->in_bytes = received > 0 ? (size_t)received : 0;
    self->in[self->in_bytes] = '\0';
    return is_ours(self, &from);
}

/// The server's error as one of ours.
static int server_error(const struct transfer *self) {
    static const int errors[] = {ERROR_IO, ERROR_MISSING, ERROR_REFUSED, ERROR_FULL,
                                 ERROR_IO, ERROR_IO,      ERROR_REFUSED, ERROR_REFUSED};
    const unsigned code = read_word(self->in + 2);
    return message_set(self->message,
                       code < sizeof errors / sizeof errors[0] ? errors[code] : ERROR_IO,
                       "%s: the server answers: %s (%u)", self->address->text,
                       (const char *)self->in + HEADER_BYTES, code);
}

/// What a packet is for the step that waits.
enum verdict { IGNORED, REPEATED, EXPECTED };

/// Sends the packet until the expected answer arrives.
static int exchange(struct transfer *self, enum verdict (*judge)(struct transfer *self)) {
    for (int i = 0; i < TRIES; i++) {
        send_packet(self, self->out, self->out_bytes, &self->peer);
        const int64_t end_ms = monotonic_now_ms() + WAIT_MS;
        enum verdict verdict = IGNORED;
        while (verdict != REPEATED && monotonic_now_ms() < end_ms) {
            if (self->observer->should_stop(self->observer->self)) {
                give_up(self, "cancelled");
                return message_set(self->message, ERROR_CANCELLED, "%s",
                                   error_text(ERROR_CANCELLED));
            }
            if (!receive(self)) {
                continue;
            }
            if (read_word(self->in) == FAILED) {
                return server_error(self);
            }
            verdict = judge(self);
            if (verdict == EXPECTED) {
                return ERROR_OK;
            }
        }
    }
    return message_set(self->message, ERROR_TIMEOUT,
                       "%s: no answer for %d s (is a TFTP server running there?)",
                       self->address->text, TRIES * WAIT_MS / 1000);
}

// ---- options

/// The next text of the packet, or NULL.
static const char *next_text(const struct transfer *self, size_t *at) {
    const char *text = (const char *)self->in + *at;
    if (*at >= self->in_bytes) {
        return NULL;
    }
    *at += strlen(text) + 1;
    return text;
}

/// Takes the options that the server accepts. False: it must not accept these.
static bool take_options(struct transfer *self, bool reading) {
    size_t at = 2;
    for (const char *name = next_text(self, &at); name != NULL; name = next_text(self, &at)) {
        const char *value = next_text(self, &at);
        const unsigned long long number = value != NULL ? strtoull(value, NULL, 10) : 0;
        if (strcasecmp(name, "blksize") == 0) {
            if (number < BLOCK_BYTES_MIN || number > BLOCK_BYTES_MAX) {
                return false;
            }
            self->block_bytes = (size_t)number;
        } else if (strcasecmp(name, "tsize") == 0 && reading) {
            self->total = number;
        }
    }
    return true;
}

static int refuse_options(struct transfer *self) {
    give_up(self, "option not requested");
    return message_set(self->message, ERROR_IO, "%s: invalid answer of the server",
                       self->address->text);
}

// ---- both directions

static int open_transfer(struct transfer *self) {
    self->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    self->peer = (struct sockaddr_in){.sin_family = AF_INET,
                                      .sin_port = self->address->port,
                                      .sin_addr.s_addr = self->address->host};
    self->block_bytes = BLOCK_BYTES;
    return self->fd >= 0 ? 0
                         : message_set(self->message, ERROR_IO, "%s: %s", self->address->text,
                                       strerror(errno));
}

static void report(const struct transfer *self) {
    if (self->block % PROGRESS_BLOCKS == 0) {
        self->observer->progress(self->observer->self, self->done, self->total);
    }
}

// ---- writing

static enum verdict judge_put(struct transfer *self) {
    const unsigned kind = read_word(self->in);
    const bool first = self->block == 0;
    return (kind == ACKNOWLEDGE && read_word(self->in + 2) == self->block) ||
                   (kind == OPTIONS && first)
               ? EXPECTED
               : IGNORED;  // sending again what was acknowledged twice would double every packet
}

/// Makes the next block; `*bytes` of the file are in it.
static int make_block(struct transfer *self, int fd, size_t *bytes) {
    const uint64_t left = self->total - self->done;
    const size_t count = left < self->block_bytes ? (size_t)left : self->block_bytes;
    self->block++;
    begin_packet(self, DATA, self->block);
    for (*bytes = 0; *bytes < count;) {
        const ssize_t read_bytes = pread(fd, self->out + HEADER_BYTES + *bytes, count - *bytes,
                                         (off_t)(self->done + *bytes));
        if (read_bytes <= 0) {
            const char *why = read_bytes == 0 ? "the file became shorter" : strerror(errno);
            give_up(self, why);
            return message_set(self->message, ERROR_IO, "%s", why);
        }
        *bytes += (size_t)read_bytes;
    }
    self->out_bytes += *bytes;
    return ERROR_OK;
}

static int send_all(struct transfer *self, int fd) {
    make_request(self, WRITE);
    int error = exchange(self, judge_put);
    if (error == ERROR_OK && read_word(self->in) == OPTIONS && !take_options(self, false)) {
        error = refuse_options(self);
    }
    size_t bytes = self->block_bytes;
    while (error == ERROR_OK && bytes == self->block_bytes) {  // a shorter block is the last one
        error = make_block(self, fd, &bytes);
        error = error != ERROR_OK ? error : exchange(self, judge_put);
        self->done += bytes;
        report(self);
    }
    return error;
}

int tftp_put(const struct tftp_address *address, int fd, uint64_t bytes,
             const struct tftp_observer *observer, struct message *message) {
    struct transfer self = {
        .address = address, .observer = observer, .message = message, .total = bytes};
    int error = open_transfer(&self);
    if (error != ERROR_OK) {
        return error;
    }
    error = send_all(&self, fd);
    close(self.fd);
    return error;
}

// ---- reading

static enum verdict judge_get(struct transfer *self) {
    const unsigned kind = read_word(self->in);
    const uint16_t next = (uint16_t)(self->block + 1);
    if (kind == OPTIONS && self->done == 0 && self->block == 0) {
        return EXPECTED;
    }
    if (kind != DATA) {
        return IGNORED;
    }
    const unsigned block = read_word(self->in + 2);
    if (block == next) {
        return EXPECTED;
    }
    return block == self->block ? REPEATED : IGNORED;
}

static int too_large(struct transfer *self, size_t capacity) {
    give_up(self, "too large");
    return message_set(self->message, ERROR_TOO_LARGE, "%s: larger than %zu bytes",
                       self->address->text, capacity);
}

/// Takes the data of a packet; `*last`: there is no more.
static int take_data(struct transfer *self, uint8_t *data, size_t capacity, bool *last) {
    const size_t bytes = self->in_bytes - HEADER_BYTES;
    if (bytes > self->block_bytes) {
        return refuse_options(self);
    }
    if (bytes > capacity - self->done) {
        return too_large(self, capacity);
    }
    memcpy(data + self->done, self->in + HEADER_BYTES, bytes);
    self->done += bytes;
    self->block++;
    *last = bytes < self->block_bytes;
    report(self);
    return 0;
}

static int receive_all(struct transfer *self, uint8_t *data, size_t capacity) {
    bool last = false;
    make_request(self, READ);
    int error = exchange(self, judge_get);
    if (error == ERROR_OK && read_word(self->in) == OPTIONS) {
        if (!take_options(self, true)) {
            return refuse_options(self);
        }
        if (self->total > capacity) {
            return too_large(self, capacity);
        }
        begin_packet(self, ACKNOWLEDGE, 0);
        error = exchange(self, judge_get);
    }
    while (error == ERROR_OK && !last) {
        error = take_data(self, data, capacity, &last);
        if (error == ERROR_OK) {
            begin_packet(self, ACKNOWLEDGE, self->block);
            error = last ? 0 : exchange(self, judge_get);
        }
    }
    if (error == ERROR_OK) {
        send_packet(self, self->out, self->out_bytes, &self->peer);
    }
    return error;
}

int tftp_get(const struct tftp_address *address, uint8_t *data, size_t capacity, size_t *bytes,
             const struct tftp_observer *observer, struct message *message) {
    struct transfer self = {.address = address, .observer = observer, .message = message};
    int error = open_transfer(&self);
    if (error != ERROR_OK) {
        return error;
    }
    error = receive_all(&self, data, capacity);
    close(self.fd);
    *bytes = (size_t)self.done;
    return error;
}
