// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/console.h"

#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/serial_device.h"

enum { RETRY_US = 1000000 };

static void open_stdio(struct console *self) {
    const bool terminal = isatty(STDIN_FILENO) != 0 && isatty(STDOUT_FILENO) != 0;
    self->stdio = true;
    if (terminal && tcgetattr(STDIN_FILENO, &self->stdio_settings) == 0) {
        struct termios raw = self->stdio_settings;
        cfmakeraw(&raw);
        self->stdio_raw = tcsetattr(STDIN_FILENO, TCSADRAIN, &raw) == 0;
    }
    // Read both flags before changing either: they may be the same file.
    for (int fd = STDIN_FILENO; fd <= STDOUT_FILENO; fd++) {
        self->stdio_flags[fd] = fcntl(fd, F_GETFL);
    }
    for (int fd = STDIN_FILENO; fd <= STDOUT_FILENO; fd++) {
        fcntl(fd, F_SETFL, self->stdio_flags[fd] | O_NONBLOCK);
    }
    connection_begin(self->client, terminal, STDIN_FILENO, STDOUT_FILENO);
}

static int open_serial(struct console *self, struct message *message) {
    struct message inner;
    const int fd = serial_device_open(self->config->console, self->config->console_baud, &inner);
    if (fd < 0) {
        return message_set(message, fd, "console = %.900s", inner.text);
    }
    connection_begin(self->client, true, fd, fd);
    return ERROR_OK;
}

int console_open(struct console *self, const struct config *config, struct connection *client,
                 struct message *message) {
    INVARIANT(!client->used);
    *self = (struct console){.config = config, .client = client};
    if (config->console[0] == '\0') {
        return ERROR_OK;
    }
    if (strcmp(config->console, "stdio") == 0) {
        open_stdio(self);
        return ERROR_OK;
    }
    const int error = open_serial(self, message);
    client->lasting = error == ERROR_OK;
    return error;
}

void console_close(struct console *self) {
    if (self->stdio_raw) {
        tcsetattr(STDIN_FILENO, TCSADRAIN, &self->stdio_settings);
    }
    for (int fd = STDIN_FILENO; self->stdio && fd <= STDOUT_FILENO; fd++) {
        fcntl(fd, F_SETFL, self->stdio_flags[fd]);
    }
}

bool console_is_stdio(const struct console *self, const struct connection *client) {
    return self->stdio && client == self->client;
}

void console_left(struct console *self, bool gone) {
    INVARIANT(!self->stdio);
    // If the line is still there, the next key gets a prompt.
    self->retry_us = gone ? monotonic_now_us() + RETRY_US : 0;
}

void console_retry(struct console *self, uint64_t now_us) {
    struct message message;
    if (!self->client->lasting || self->client->used || now_us < self->retry_us) {
        return;
    }
    if (open_serial(self, &message) != 0) {
        self->retry_us = now_us + RETRY_US;
    }
}
