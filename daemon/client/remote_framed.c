// SPDX-License-Identifier: Apache-2.0
// A command over a line that damages and loses bytes. It is repeated if it arrived damaged, as it
// was not executed then, or if it only reads. While a command runs the daemon sends keepalives, so
// silence means that its answer, or the command, was lost.
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/framing.h"
#include "daemon/client/remote.h"
#include "daemon/client/remote_framing.h"

enum {
    TRIES = 12,
    SILENT_TRIES = 3,   ///< in a row without any data: the peer is gone
    SILENCE_MS = 3000,  ///< keepalives are more frequent
    GARBAGE_BYTES = 4 * REMOTE_LINE_BYTES
};

enum outcome {
    GOES_ON,
    ANSWERED_OK,
    ANSWERED_ERR,
    NOT_RECEIVED,  ///< the request arrived damaged and was not executed
    UNANSWERED,
    BROKEN
};

/// An answer being received.
struct receiving {
    struct remote *remote;
    remote_show *show;
    void *cookie;
    char *text;     ///< REMOTE_LINE_BYTES: lines not yet verified
    size_t length;  ///< of them
    bool damaged;   ///< garbage arrived in this attempt
    bool ever_damaged;
    bool rounds;  ///< of a watch have arrived
};

static void record_damage(struct receiving *self) {
    self->damaged = true;
    self->ever_damaged = true;
    self->length = 0;
}

/// Shows a verified line.
static void show_line(struct receiving *self, const char *line) {
    remote_progress(self->remote, "", 0, 0);
    self->show(self->remote, self->cookie, line);
}

/// Shows the first `length` bytes of lines, now verified.
static void show_lines(struct receiving *self, size_t length) {
    for (size_t at = 0; at < length;) {
        char *line = self->text + at;
        char *end = memchr(line, '\n', length - at);
        INVARIANT(end != NULL);
        *end = '\0';
        at += (size_t)(end - line) + 1;
        show_line(self, line);
    }
}

/// Whether a successful watch may have lost rounds.
static bool needs_rounds(const struct receiving *self) {
    return self->rounds && self->ever_damaged;
}

/// Keeps a line until its CRC arrives with the last line; progress is shown at once.
static void keep_line(struct receiving *self, const char *line) {
    const size_t bytes = strlen(line) + 1;
    if (bytes > REMOTE_LINE_BYTES - self->length) {
        record_damage(self);
    } else if (!remote_show_progress(self->remote, line)) {
        memcpy(self->text + self->length, line, bytes - 1);
        self->text[self->length + bytes - 1] = '\n';
        self->length += bytes;
    }
}

/// Processes a line of a text answer.
static enum outcome receive_text(struct receiving *self, char *line) {
    const uint32_t crc = crc_update(0, self->text, self->length);
    const enum remote_framing framing = remote_framing_take_text(line, crc);
    if (framing == REMOTE_FRAMING_DAMAGED) {
        record_damage(self);
        return GOES_ON;
    }
    if (framing == REMOTE_FRAMING_NONE) {
        keep_line(self, line);
        return GOES_ON;
    }
    const size_t length = self->length;
    self->length = 0;
    const bool ok = strcmp(line, "OK") == 0;
    show_lines(self, length);
    self->rounds = self->rounds || line[0] == '\0';
    if (!ok || !needs_rounds(self)) {
        show_line(self, line);
    }
    return line[0] == '\0' ? GOES_ON : ok ? ANSWERED_OK : ANSWERED_ERR;
}

/// Processes a line of a JSON answer.
static enum outcome receive_json(struct receiving *self, char *line) {
    char event[32] = "";
    struct cJSON *all = json_parse(line);
    const bool whole = all != NULL && remote_framing_fits_json(line);
    const bool ok = json_member_true(all, "ok");
    json_member_text(all, "event", event, sizeof event);
    cJSON_Delete(all);
    if (!whole) {
        record_damage(self);
        return GOES_ON;
    }
    self->rounds = self->rounds || strcmp(event, "watch") == 0;
    if (!ok || !needs_rounds(self)) {
        remote_framing_strip_json(line);
        show_line(self, line);
    }
    return event[0] != '\0' ? GOES_ON : ok ? ANSWERED_OK : ANSWERED_ERR;
}

/// Waits for the answer as long as keepalives arrive.
static enum outcome receive(struct receiving *self) {
    const struct remote_line *line = &self->remote->line;
    enum outcome outcome = GOES_ON;
    uint64_t from = line->rx_bytes;
    self->length = 0;
    self->damaged = false;
    while (outcome == GOES_ON) {
        char *text = NULL;
        const int error =
            remote_receive(self->remote, self->damaged ? FRAMING_QUIET_MS : SILENCE_MS, &text);
        if (error != 0) {
            return error == ERROR_DEVICE ? BROKEN : UNANSWERED;
        }
        outcome = remote_is_refused(text) ? NOT_RECEIVED
                  : self->remote->json    ? receive_json(self, text)
                                          : receive_text(self, text);
        // No valid answer is that long.
        if (outcome == GOES_ON && line->rx_bytes - from > GARBAGE_BYTES) {
            return UNANSWERED;
        }
        from = self->rounds && !self->damaged ? line->rx_bytes : from;
    }
    return outcome;
}

static int conclude(const struct receiving *self, enum outcome outcome, bool perhaps,
                    struct message *message) {
    const char *const doubt = perhaps ? "; it is unknown whether the command was executed" : "";
    if (outcome == ANSWERED_OK && needs_rounds(self)) {
        return message_set(message, ERROR_CRC,
                           "rounds of the watch may be missing: the line damages data");
    }
    if (outcome == ANSWERED_OK || outcome == ANSWERED_ERR) {
        return outcome == ANSWERED_OK ? 0 : 1;
    }
    if (outcome == BROKEN) {
        return message_set(message, ERROR_DEVICE, "connection lost%s", doubt);
    }
    if (self->remote->interrupted) {
        return message_set(message, ERROR_CANCELLED, "interrupted%s", doubt);
    }
    return message_set(message, ERROR_TIMEOUT, "no undamaged answer arrives over the line%s",
                       doubt);
}

/// Whether a command only reads, so that it may be executed again.
static bool only_reads(const char *command) {
    static const char *const names[] = {"complete", "config", "files",  "health", "help",
                                        "log",      "status", "system", "version"};
    const size_t bytes = strcspn(command, " ");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strlen(names[i]) == bytes && strncmp(command, names[i], bytes) == 0) {
            return true;
        }
    }
    return false;
}

/// Sends the request until its outcome is known, or the peer is gone. `perhaps`: it may have been
/// executed.
static enum outcome repeat(struct receiving *self, const char *request, bool may_repeat,
                           bool *perhaps) {
    struct remote *remote = self->remote;
    enum outcome outcome = UNANSWERED;
    int silent = 0;
    for (int i = 0; i < TRIES && silent < SILENT_TRIES && !remote_interrupted(remote); i++) {
        const uint64_t before = remote->line.rx_bytes;
        // A failed send counts as not received.
        const bool sent = remote_line_send(&remote->line, request, strlen(request));
        outcome = sent ? receive(self) : BROKEN;
        *perhaps = *perhaps || outcome == UNANSWERED || (sent && outcome == BROKEN);
        silent = remote->line.rx_bytes == before ? silent + 1 : 0;
        if (outcome != NOT_RECEIVED && (outcome != UNANSWERED || !may_repeat)) {
            break;
        }
        // A damaged line may have become two, each with its answer.
        if (outcome == NOT_RECEIVED && remote_drain(remote) != 0) {
            return BROKEN;
        }
    }
    return outcome;
}

int remote_ask_framed(struct remote *self, const char *command, remote_show *show, void *cookie,
                      struct message *message) {
    struct receiving receiving = {.remote = self, .show = show, .cookie = cookie};
    char request[REMOTE_REQUEST_BYTES];
    bool perhaps = false;
    if (!remote_framing_request(self->json ? "json,progress" : "progress", command, request)) {
        return message_set(message, ERROR_SYNTAX, "command too long");
    }
    receiving.text = malloc(REMOTE_LINE_BYTES);
    if (receiving.text == NULL) {
        return message_set(message, ERROR_MEMORY, "out of memory");
    }
    const enum outcome outcome = repeat(&receiving, request, only_reads(command), &perhaps);
    remote_progress(self, "", 0, 0);
    free(receiving.text);
    return conclude(&receiving, outcome, perhaps, message);
}
