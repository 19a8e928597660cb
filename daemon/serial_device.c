// SPDX-License-Identifier: Apache-2.0
#include "daemon/serial_device.h"

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"

static speed_t speed_of(uint32_t baud) {
    static const struct {
        uint32_t baud;
        speed_t speed;
    } speeds[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
                  {115200, B115200}, {230400, B230400}, {460800, B460800}, {921600, B921600}};
    for (size_t i = 0; i < sizeof speeds / sizeof speeds[0]; i++) {
        if (speeds[i].baud == baud) {
            return speeds[i].speed;
        }
    }
    return B0;
}

bool serial_device_has_speed(uint32_t baud) {
    return speed_of(baud) != B0;
}

int serial_device_open(const char *device, uint32_t baud, struct message *message) {
    const speed_t speed = speed_of(baud);
    if (speed == B0) {
        return message_set(message, ERROR_ARGUMENT,
                           "%s: there is no speed of %u baud; there are " SERIAL_DEVICE_SPEEDS,
                           device, (unsigned)baud);
    }
    const int fd = open(device, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    struct termios settings;
    if (fd < 0 || tcgetattr(fd, &settings) != 0) {
        const int number = errno;
        if (fd >= 0) {
            close(fd);
        }
        return number == ENOTTY || number == EISDIR
                   ? message_set(message, ERROR_DEVICE, "%s: is no serial line", device)
                   : message_set(message, ERROR_IO, "%s: %s", device, strerror(number));
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    settings.c_cflag &= ~(tcflag_t)(CRTSCTS | CSTOPB);
    if (cfsetspeed(&settings, speed) != 0 || tcsetattr(fd, TCSANOW, &settings) != 0) {
        const int number = errno;
        if (fd >= 0) {
            close(fd);
        }
        return message_set(message, ERROR_IO, "%s: %s", device, strerror(number));
    }
    INVARIANT(fd >= 0);
    return fd;
}
