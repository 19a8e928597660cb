// SPDX-License-Identifier: Apache-2.0
#include "fake_serial.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>

#include "fake_file.h"

enum { MAJOR = 4, MINOR = 65 };

/// Whether both ends use the same settings, so that bytes pass unchanged.
static bool understands(const struct fake_serial *self) {
    const struct termios *now = &self->settings;
    const tcflag_t frame = CSIZE | PARENB | CSTOPB;
    return (now->c_cflag & frame) == CS8 && cfgetospeed(now) == self->speed &&
           cfgetispeed(now) == self->speed && (now->c_oflag & OPOST) == 0 &&
           (now->c_lflag & (ICANON | ECHO | ISIG)) == 0 &&
           (now->c_iflag & (ICRNL | INLCR | IGNCR | ISTRIP | IXON | IXOFF)) == 0;
}

/// A byte as received with different settings.
static uint8_t garbled(uint8_t byte) {
    return (uint8_t)(byte << 1 | 0x81);
}

static void describe(struct fake_file *file, unsigned long request, const void *argument,
                     char *line, size_t bytes) {
    (void)file;
    (void)argument;
    if (request == TIOCEXCL || request == TIOCNXCL) {
        snprintf(line, bytes, "%s", request == TIOCEXCL ? "TIOCEXCL" : "TIOCNXCL");
    }
}

static int control(struct fake_file *file, unsigned long request, void *argument) {
    struct fake_serial *self = file->state;
    switch (request) {
        case TIOCEXCL:
        case TIOCNXCL:
            return 0;
        case TCGETS:
            *(struct termios *)argument = self->settings;
            return 0;
        case TCSETS:
            self->settings = *(const struct termios *)argument;
            return 0;
        case TCFLSH:
            self->look(self);
            self->count = 0;
            return 0;
        default:
            return -ENOTTY;
    }
}

static int read_bytes(struct fake_file *file, void *data, size_t bytes) {
    struct fake_serial *self = file->state;
    self->look(self);
    const size_t part = bytes < self->count ? bytes : self->count;
    memcpy(data, self->received, part);
    self->count -= part;
    memmove(self->received, self->received + part, self->count);
    return part > 0 ? (int)part : -EAGAIN;
}

static int write_bytes(struct fake_file *file, const void *data, size_t bytes) {
    struct fake_serial *self = file->state;
    uint8_t sent[FAKE_SERIAL_BYTES];
    const size_t part = bytes < sizeof sent ? bytes : sizeof sent;
    memcpy(sent, data, part);
    for (size_t i = 0; i < part && !understands(self); i++) {
        sent[i] = garbled(sent[i]);
    }
    self->send(sent, part);
    return (int)part;
}

static short poll_line(struct fake_file *file, uint64_t now_us, uint64_t *next_us) {
    struct fake_serial *self = file->state;
    (void)now_us;
    (void)next_us;
    self->look(self);
    return (short)(POLLOUT | (self->count > 0 ? POLLIN : 0));
}

void fake_serial_receive(struct fake_serial *self, const uint8_t *bytes, size_t count) {
    for (size_t i = 0; i < count && self->count < sizeof self->received; i++) {
        self->received[self->count++] = understands(self) ? bytes[i] : garbled(bytes[i]);
    }
}

void fake_serial_add(const char *path, struct fake_serial *self) {
    static const struct fake_operations operations = {.describe = describe,
                                                      .ioctl = control,
                                                      .read = read_bytes,
                                                      .write = write_bytes,
                                                      .poll = poll_line};
    self->settings = (struct termios){.c_iflag = ICRNL | IXON,
                                      .c_oflag = OPOST | ONLCR,
                                      .c_cflag = CS8 | CREAD | HUPCL,
                                      .c_lflag = ISIG | ICANON | ECHO};
    cfsetispeed(&self->settings, B38400);
    cfsetospeed(&self->settings, B38400);
    self->count = 0;
    fake_file_device(path, MAJOR, MINOR, &operations, self);
}
