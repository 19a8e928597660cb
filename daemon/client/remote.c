// SPDX-License-Identifier: Apache-2.0
#include "daemon/client/remote.h"

#include <cjson/cJSON.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "core/error.h"
#include "daemon/base/framing.h"
#include "daemon/base/message.h"
#include "daemon/base/monotonic.h"
#include "daemon/cli/progress.h"
#include "daemon/cli/screen.h"
#include "daemon/client/remote_framing.h"
#include "daemon/files/token.h"

enum {
    CALL_TRIES = 12,   ///< of a request that may be repeated
    SILENT_TRIES = 3,  ///< in a row without an answer: the peer is gone
    CALL_SERIAL_MS = 3000,
    CALL_SOCKET_MS = 60000,
    HELLO_BYTES = sizeof TOKEN_PREFIX + TOKEN_BYTES + 1,
};

bool remote_quote(const char *word, char *text) {
    size_t length = 0;
    text[length++] = '"';
    for (const char *at = word; *at != '\0'; at++) {
        // Two for the character, two for the end.
        if (length + 4 > REMOTE_REQUEST_BYTES) {
            return false;
        }
        if (*at == '"' || *at == '\\') {
            text[length++] = '\\';
        }
        text[length++] = *at;
    }
    memcpy(text + length, "\"", 2);
    return true;
}

bool remote_files_command(const char *name, const char *after, char *command) {
    char quoted[2][REMOTE_REQUEST_BYTES] = {"", ""};
    if (!remote_quote(name, quoted[0]) || (after != NULL && !remote_quote(after, quoted[1]))) {
        return false;
    }
    const int length = snprintf(command, REMOTE_REQUEST_BYTES, "files %s%s%s", quoted[0],
                                after != NULL ? " after=" : "", quoted[1]);
    return length > 0 && length < REMOTE_REQUEST_BYTES;
}

void remote_progress(struct remote *self, const char *what, uint64_t done, uint64_t total) {
    if (isatty(STDERR_FILENO) == 0) {
        return;
    }
    if (total == 0) {
        progress_erase(stderr, self->bar_columns);
        self->bar_columns = 0;
        return;
    }
    self->bar_columns =
        progress_draw(stderr, screen_columns(STDERR_FILENO), PROGRESS_TEXT_MAX, what, done, total);
}

bool remote_interrupted(struct remote *self) {
    struct pollfd extra = {.fd = self->extra_fd, .events = POLLIN};
    while (!self->interrupted && self->extra_fd >= 0 && poll(&extra, 1, 0) > 0) {
        self->service(self);
        extra.fd = self->extra_fd;
    }
    return self->interrupted;
}

void remote_interrupt(struct remote *self) {
    if (!self->interrupted) {
        self->interrupted = true;
        remote_line_send(&self->line, "\003", 1);
    }
}

static int give_up(struct message *message) {
    return message_set(message, ERROR_CANCELLED, "interrupted");
}

bool remote_show_progress(struct remote *self, const char *text) {
    if (strncmp(text, "... ", 4) != 0) {
        return false;
    }
    char what[64];
    const char *blank = strrchr(text, ' ');
    const char *slash = strrchr(text, '/');
    if (blank > text + 3 && slash != NULL && slash > blank) {
        snprintf(what, sizeof what, "%.*s", (int)(blank - text - 4), text + 4);
        remote_progress(self, what, strtoull(blank + 1, NULL, 10), strtoull(slash + 1, NULL, 10));
    }
    return true;
}

int remote_drain(struct remote *self) {
    int error = 0;
    while (error == 0) {
        char *text = NULL;
        error = remote_receive(self, FRAMING_QUIET_MS, &text);
    }
    return error == ERROR_TIMEOUT ? 0 : error;
}

bool remote_is_refused(const char *text) {
    return strstr(text, FRAMING_DAMAGED) != NULL;
}

int remote_receive(struct remote *self, int limit_ms, char **text) {
    struct remote_line *line = &self->line;
    uint64_t since_us = monotonic_now_us();
    for (;;) {
        bool extra = false;
        const uint64_t now_us = monotonic_now_us();
        // On a serial line any data or keepalive restarts the wait.
        since_us = line->serial && line->last_rx_us > since_us ? line->last_rx_us : since_us;
        const int64_t left_ms = limit_ms - (int64_t)((now_us - since_us) / MONOTONIC_US_IN_MS);
        if (limit_ms >= 0 && left_ms <= 0) {
            return ERROR_TIMEOUT;
        }
        const int wait_ms = limit_ms >= 0 ? (int)left_ms : limit_ms;
        const int error = remote_line_receive(line, wait_ms, self->extra_fd, &extra, text);
        if (error != ERROR_CANCELLED && error != ERROR_TIMEOUT) {
            return error;
        }
        if (extra && self->service != NULL) {
            self->service(self);
        }
    }
}

/// Whether a line is the answer itself, and whether it says ok; whether it is JSON at all.
static bool is_json_end(const char *text, bool *ok, bool *valid) {
    struct cJSON *all = json_parse(text);
    const bool end = cJSON_HasObjectItem(all, "ok");
    *ok = json_member_true(all, "ok");
    *valid = all != NULL;
    cJSON_Delete(all);
    return end;
}

/// Whether a line of text ends the answer.
static bool is_text_end(const char *text, bool *ok) {
    *ok = strncmp(text, "OK", 2) == 0 && (text[2] == '\0' || text[2] == ' ');
    return *ok || strncmp(text, "ERR ", 4) == 0;
}

/// Whether a line rejects the client; the daemon sends it as text, before it knows the client's
/// format. Without a reason it is garbage.
static bool is_turned_away(const char *text) {
    return strncmp(text, "ERR ", 4) == 0 && text[4] > ' ';
}

/// Waits for the answer to the greeting. 0, ERROR_DEVICE, ERROR_TIMEOUT or ERROR_CANCELLED.
static int await_greeting(struct remote *self, char **text) {
    int limit_ms = remote_line_left_ms(&self->line);
    for (;;) {
        bool extra = false;
        const int error = remote_line_receive(&self->line, limit_ms, self->extra_fd, &extra, text);
        if (extra) {
            self->service(self);
        }
        if (self->interrupted) {
            return ERROR_CANCELLED;
        }
        if (error == ERROR_TIMEOUT && self->interactive) {
            fputs("vergence: vergenced does not answer yet; Ctrl-C gives up\n", stderr);
            limit_ms = REMOTE_FOREVER_MS;
        } else if (error != ERROR_CANCELLED) {
            return error;
        }
    }
}

/// Makes the first line: over TCP the token. If no token file was named and the default one does
/// not exist, the daemon decides whether a token is required: a tunnel may lead to a Unix socket.
static int make_hello(const struct remote *self, char hello[HELLO_BYTES], struct message *message) {
    char token[TOKEN_BYTES];
    int error = ERROR_MISSING;
    if (self->line.tcp) {
        error = token_read(self->token_path, token, message);
    }
    if (error == ERROR_MISSING && self->token_path == NULL) {
        strcpy(hello, "@text\n");  // the default
        return 0;
    }
    if (error == 0) {
        snprintf(hello, HELLO_BYTES, TOKEN_PREFIX "%s\n", token);
    }
    return error;
}

int remote_greet(struct remote *self, remote_show *show, void *cookie, struct message *message) {
    char hello[HELLO_BYTES];
    char *text = NULL;
    if (self->line.serial) {
        return 0;
    }
    int error = make_hello(self, hello, message);
    if (error != 0) {
        return error;
    }
    // A daemon that hung up has sent the reason, which can still be read if sending fails.
    remote_line_send(&self->line, hello, strlen(hello));
    error = await_greeting(self, &text);
    if (error == ERROR_CANCELLED) {
        return give_up(message);
    }
    if (error == ERROR_TIMEOUT) {
        return message_set(message, error, "no answer (is vergenced running there?)");
    }
    if (error != 0) {
        return message_set(message, ERROR_DEVICE, "connection lost");
    }
    if (is_turned_away(text)) {
        remote_show_rejection(self, show, cookie, text);
        return 1;
    }
    return strcmp(text, "OK") == 0
               ? 0
               : message_set(message, ERROR_VERSION, "invalid answer from vergenced");
}

/// Shows the answer to a request that was sent. 0: OK; 1: ERR; ERROR_DEVICE or ERROR_VERSION with a
/// message.
static int show_answer(struct remote *self, remote_show *show, void *cookie,
                       struct message *message) {
    for (;;) {
        char *text = NULL;
        bool ok = false;
        if (remote_receive(self, REMOTE_FOREVER_MS, &text) != 0) {
            remote_progress(self, "", 0, 0);
            return message_set(message, ERROR_DEVICE, "connection lost");
        }
        bool valid = true;
        if (!self->json && remote_show_progress(self, text)) {
            continue;
        }
        const bool end = self->json ? is_json_end(text, &ok, &valid) : is_text_end(text, &ok);
        if (!valid) {
            return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
        }
        remote_progress(self, "", 0, 0);
        show(self, cookie, text);
        if (end) {
            return ok ? 0 : 1;
        }
    }
}

/// remote_ask over a socket, which loses nothing.
static int ask_socket(struct remote *self, const char *command, remote_show *show, void *cookie,
                      struct message *message) {
    char request[REMOTE_REQUEST_BYTES];
    const int length =
        snprintf(request, sizeof request, "@%sprogress %s\n", self->json ? "json," : "", command);
    if (length < 0 || (size_t)length >= sizeof request) {
        return message_set(message, ERROR_SYNTAX, "command too long");
    }
    if (remote_interrupted(self)) {
        return give_up(message);
    }
    if (!remote_line_send(&self->line, request, (size_t)length)) {
        remote_progress(self, "", 0, 0);
        return message_set(message, ERROR_DEVICE, "connection lost");
    }
    return show_answer(self, show, cookie, message);
}

int remote_ask(struct remote *self, const char *command, remote_show *show, void *cookie,
               struct message *message) {
    return (self->line.serial ? remote_ask_framed : ask_socket)(self, command, show, cookie,
                                                                message);
}

/// Waits for `answer`. ERROR_CRC: it, or the request, arrived damaged.
static int take_answer(struct remote *self, int limit_ms) {
    char *text = NULL;
    const int error = remote_receive(self, limit_ms, &text);
    if (error != 0) {
        return error;
    }
    cJSON_Delete(self->answer);
    self->answer = json_parse(text);
    const bool whole = self->answer != NULL && remote_framing_fits_json(text);
    return whole && !remote_is_refused(text) ? 0 : ERROR_CRC;
}

/// Reads an intact answer. 0: OK, with `result`; else ERROR_REFUSED or ERROR_CANCELLED.
static int read_answer(struct remote *self, const struct cJSON **result, struct message *message) {
    char name[32] = "";
    char text[512] = "";
    *result = cJSON_GetObjectItemCaseSensitive(self->answer, "result");
    if (json_member_true(self->answer, "ok")) {
        return 0;
    }
    json_member_text(self->answer, "error", name, sizeof name);
    json_member_text(self->answer, "message", text, sizeof text);
    if (self->interrupted && strcmp(name, error_name(ERROR_CANCELLED)) == 0) {
        return give_up(message);
    }
    self->refused = true;
    return message_set(message, ERROR_REFUSED, "%s %s", name, text);
}

int remote_call(struct remote *self, const char *command, const struct cJSON **result,
                struct message *message) {
    const bool serial = self->line.serial;
    char request[REMOTE_REQUEST_BYTES];
    int error = ERROR_TIMEOUT;
    int silent = 0;
    self->refused = false;
    if (!remote_framing_request("json", command, request)) {
        return message_set(message, ERROR_SYNTAX, "command too long");
    }
    // A socket loses nothing.
    for (int i = 0; i < (serial ? CALL_TRIES : 1) && silent < SILENT_TRIES; i++) {
        if (remote_interrupted(self)) {
            return give_up(message);
        }
        const bool sent = remote_line_send(&self->line, request, strlen(request));
        error = sent ? take_answer(self, serial ? CALL_SERIAL_MS : CALL_SOCKET_MS) : ERROR_DEVICE;
        silent = error == ERROR_TIMEOUT ? silent + 1 : 0;
        if (error == 0) {
            return read_answer(self, result, message);
        }
        error = error == ERROR_CRC ? remote_drain(self) : error;
        if (error == ERROR_DEVICE) {
            return message_set(message, ERROR_DEVICE, "connection lost");
        }
    }
    return message_set(message, ERROR_TIMEOUT, "no undamaged answer arrives over the line");
}
