// SPDX-License-Identifier: Apache-2.0
#include "daemon/base/serial_device.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"

enum { MIN_BAUD = 9600 };

bool serial_device_speed(uint32_t bits_per_s, speed_t *speed) {
    static const struct {
        uint32_t bits_per_s;
        speed_t speed;
    } speeds[] = {
        {1200, B1200},     {2400, B2400},     {4800, B4800},     {9600, B9600},
        {19200, B19200},   {38400, B38400},   {57600, B57600},   {115200, B115200},
        {230400, B230400}, {460800, B460800}, {921600, B921600},
    };
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        if (speeds[i].bits_per_s == bits_per_s) {
            *speed = speeds[i].speed;
            return true;
        }
    }
    return false;
}

bool serial_device_has_speed(uint32_t baud) {
    speed_t speed = B0;
    return baud >= MIN_BAUD && serial_device_speed(baud, &speed);
}

bool serial_device_claim(int fd) {
    INVARIANT(fd >= 0);
    // Lock first: if that fails, the owner's terminal stays unchanged.
    return flock(fd, LOCK_EX | LOCK_NB) == 0 && ioctl(fd, TIOCEXCL) == 0;
}

void serial_device_release(int fd) {
    ioctl(fd, TIOCNXCL);
}

void serial_device_close(int fd) {
    serial_device_release(fd);
    close(fd);
}

static int make_raw(int fd, speed_t speed) {
    struct termios settings;
    if (tcgetattr(fd, &settings) != 0) {
        return -1;
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~(tcflag_t)(CRTSCTS | CSTOPB);
    return cfsetspeed(&settings, speed) != 0 ? -1 : tcsetattr(fd, TCSANOW, &settings);
}

static int report(const char *device, int number, struct message *message) {
    switch (number) {
        case ENOTTY:
        case EISDIR:
            return message_set(message, ERROR_DEVICE, "%s: not a serial line", device);
        case EWOULDBLOCK:
        case EBUSY:
            return message_set(message, ERROR_REFUSED,
                               "%s: in use by another program (end it first)", device);
        default:
            return message_set(message, ERROR_IO, "%s: %s", device, strerror(number));
    }
}

int serial_device_open(const char *device, uint32_t baud, struct message *message) {
    speed_t speed = B0;
    if (!serial_device_has_speed(baud) || !serial_device_speed(baud, &speed)) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: unsupported speed %u (expected " SERIAL_DEVICE_SPEEDS ")", device,
                           (unsigned)baud);
    }
    const int fd = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
        return report(device, errno, message);
    }
    if (!serial_device_claim(fd)) {
        const int number = errno;
        close(fd);
        return report(device, number, message);
    }
    if (make_raw(fd, speed) != 0) {
        const int number = errno;
        serial_device_close(fd);
        return report(device, number, message);
    }
    return fd;
}
