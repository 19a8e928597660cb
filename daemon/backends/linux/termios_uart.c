// SPDX-License-Identifier: Apache-2.0
#include "daemon/backends/linux/termios_uart.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/linux/device_file.h"
#include "daemon/base/serial_device.h"

/// EIO also means that the line is gone: it is what an unplugged USB adapter returns.
static int error_of(int error_number) {
    return error_number == EIO ? ERROR_DEVICE : device_file_error(error_number);
}

static int wait_for(const struct termios_uart *self, short events, uint64_t deadline_us) {
    short revents = 0;
    const int error = device_file_wait(self->fd, events, deadline_us, &revents);
    if (error != ERROR_OK) {
        return error;
    }
    // Input received before the hang-up can still be read.
    return (revents & events) != 0 ? ERROR_OK : ERROR_DEVICE;
}

static int write_all(void *opaque, const void *data, size_t bytes, uint64_t deadline_us) {
    const struct termios_uart *self = opaque;
    INVARIANT(data != NULL || bytes == 0);
    if (self->fd < 0) {
        return ERROR_DEVICE;
    }
    const uint8_t *next = data;
    while (bytes > 0) {
        const int error = wait_for(self, POLLOUT, deadline_us);
        if (error != ERROR_OK) {
            return error;
        }
        const ssize_t written = write(self->fd, next, bytes);
        if (written < 0 && errno != EINTR && errno != EAGAIN) {
            return error_of(errno);
        }
        if (written > 0) {
            INVARIANT((size_t)written <= bytes);
            next += written;
            bytes -= (size_t)written;
        }
    }
    return ERROR_OK;
}

static int read_some(void *opaque, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    const struct termios_uart *self = opaque;
    INVARIANT(capacity > 0);
    if (self->fd < 0) {
        return ERROR_DEVICE;
    }
    for (;;) {
        const int error = wait_for(self, POLLIN, deadline_us);
        if (error != ERROR_OK) {
            return error;
        }
        const ssize_t got = read(self->fd, data, capacity);
        if (got > 0) {
            *bytes = (size_t)got;
            return ERROR_OK;
        }
        // Ready without a byte is end of file: the line was hung up.
        if (got == 0) {
            return ERROR_DEVICE;
        }
        if (errno != EINTR && errno != EAGAIN) {
            return error_of(errno);
        }
    }
}

static int discard(void *opaque) {
    const struct termios_uart *self = opaque;
    if (self->fd < 0) {
        return ERROR_DEVICE;
    }
    return tcflush(self->fd, TCIFLUSH) == 0 ? ERROR_OK : error_of(errno);
}

/// Whether the driver applied the settings that matter: tcsetattr returns 0 if it applied any.
static bool settings_took_effect(int fd, const struct termios *wanted) {
    struct termios now;
    const tcflag_t control = CSIZE | PARENB | CSTOPB | CREAD | CRTSCTS;
    return tcgetattr(fd, &now) == 0 && (now.c_cflag & control) == (wanted->c_cflag & control) &&
           (now.c_lflag & (ICANON | ECHO | ISIG)) == 0 && (now.c_oflag & OPOST) == 0 &&
           cfgetospeed(&now) == cfgetospeed(wanted) && cfgetispeed(&now) == cfgetispeed(wanted);
}

static int make_raw(int fd, speed_t speed) {
    struct termios settings;
    if (tcgetattr(fd, &settings) != 0) {
        return errno == ENOTTY ? ERROR_UNSUPPORTED : error_of(errno);
    }
    cfmakeraw(&settings);
    settings.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_iflag &= ~(tcflag_t)(IXON | IXOFF);
    settings.c_cc[VMIN] = 1;  // a read of 0 bytes means end of file, not that no byte is available
    settings.c_cc[VTIME] = 0;
    if (cfsetispeed(&settings, speed) != 0 || cfsetospeed(&settings, speed) != 0 ||
        tcsetattr(fd, TCSANOW, &settings) != 0) {
        return errno == EINVAL ? ERROR_UNSUPPORTED : error_of(errno);
    }
    if (!settings_took_effect(fd, &settings)) {
        errno = EINVAL;
        return ERROR_UNSUPPORTED;
    }
    return tcflush(fd, TCIOFLUSH) == 0 ? ERROR_OK : error_of(errno);
}

static int claim(struct termios_uart *self) {
    self->exclusive = serial_device_claim(self->fd);
    if (self->exclusive) {
        return ERROR_OK;
    }
    if (errno == EWOULDBLOCK) {
        return ERROR_REFUSED;
    }
    return errno == ENOTTY ? ERROR_UNSUPPORTED : error_of(errno);
}

void termios_uart_init(struct termios_uart *self) {
    static const struct hal_uart_operations operations = {write_all, read_some, discard};
    *self = (struct termios_uart){.hal = {&operations, self}, .fd = -1};
}

int termios_uart_open(struct termios_uart *self, const char *path, uint32_t bits_per_s,
                      struct message *message) {
    termios_uart_init(self);
    speed_t speed = B0;
    if (!serial_device_speed(bits_per_s, &speed)) {
        return message_set(message, ERROR_UNSUPPORTED,
                           "serial line %s: unsupported speed %u bit/s (expected a standard speed "
                           "such as 9600 or 115200, up to 921600)",
                           path, (unsigned)bits_per_s);
    }
    const int fd = device_file_open(path, O_RDWR | O_NONBLOCK, "serial line", message);
    if (fd < 0) {
        return fd;
    }
    self->fd = fd;
    int error = claim(self);
    if (error == ERROR_REFUSED) {
        message_set(message, error, "serial line %s: in use by another program (end it first)",
                    path);
        termios_uart_close(self);
        return error;
    }
    if (error == ERROR_OK) {
        error = make_raw(fd, speed);
    }
    if (error != ERROR_OK) {
        message_set(message, error, "serial line %s: cannot set %u bit/s, 8N1, raw: %s", path,
                    (unsigned)bits_per_s, strerror(errno));
        termios_uart_close(self);
    }
    return error;
}

void termios_uart_close(struct termios_uart *self) {
    if (self->exclusive) {
        serial_device_release(self->fd);
        self->exclusive = false;
    }
    device_file_close(&self->fd);
}

bool termios_uart_is_current(const struct termios_uart *self, const char *path) {
    struct pollfd polled = {.fd = self->fd};
    return device_file_is_current(self->fd, path) && poll(&polled, 1, 0) == 0;
}
