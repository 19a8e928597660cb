// SPDX-License-Identifier: Apache-2.0
// A command and its answer. A serial line damages and loses bytes: there both carry a CRC (formats:
// console/line/request.h and reply.h). A command is repeated if it arrived damaged, as it was not
// executed then, or if it only reads. While a command runs the daemon sends keepalives, so silence
// means that its answer, or the command, was lost.
#include <cjson/cJSON.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "console/line/framing.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/client/remote.h"

enum {
    TRIES = 12,
    SILENT_TRIES = 3,   ///< attempts in a row without any data, after which the peer is gone
    SILENCE_MS = 3000,  ///< keepalives are more frequent
    CRC_DIGITS = 8,
    GARBAGE_BYTES = 4 * REMOTE_LINE_BYTES  ///< no valid answer is that long
};

static const char json_mark[] = ", \"crc\": \"";

enum outcome {
    GOES_ON,
    ANSWERED_OK,
    ANSWERED_ERR,
    NOT_RECEIVED,  ///< the request arrived damaged and was not executed
    INVALID,       ///< not an answer of vergenced
    UNANSWERED,
    BROKEN
};

/// An answer being received.
struct answer {
    struct remote *remote;
    bool json;
    remote_show *show;
    void *cookie;
    char *text;     ///< REMOTE_LINE_BYTES: lines not yet verified
    size_t length;  ///< length of `text`
    bool damaged;   ///< garbage arrived in this attempt
    bool ever_damaged;
    bool rounds;  ///< rounds of a watch have arrived
};

/// Makes the request line: over a serial line with a CRC and after a byte that ends any garbage.
static bool make_request(const struct answer *self, const char *command,
                         char request[REMOTE_REQUEST_BYTES]) {
    const bool serial = self->remote->line.serial;
    const int begun = snprintf(request, REMOTE_REQUEST_BYTES, "%s@%s%sprogress%s",
                               serial ? "\r" : "", self->json ? "json," : "",
                               self->remote->take != NULL ? "binary," : "", serial ? "," : " ");
    INVARIANT(begun > 0 && begun < REMOTE_REQUEST_BYTES);
    const size_t room = REMOTE_REQUEST_BYTES - (size_t)begun;
    int rest = 0;
    if (serial) {
        // The CRC covers neither itself nor what comes before and after the line.
        uint32_t crc = crc_update(0, request + 1, (size_t)begun - 1);
        crc = crc_update(crc, command, strlen(command));
        rest = snprintf(request + begun, room, "crc=%08" PRIX32 " %s\n", crc, command);
    } else {
        rest = snprintf(request + begun, room, "%s\n", command);
    }
    return rest > 0 && (size_t)rest < room;
}

/// Whether the text is this CRC, in eight digits of either case.
static bool is_crc(const char *text, uint32_t crc) {
    char digits[CRC_DIGITS + 1];
    memcpy(digits, text, CRC_DIGITS);
    digits[CRC_DIGITS] = '\0';
    return strspn(digits, "0123456789ABCDEFabcdef") == CRC_DIGITS &&
           (uint32_t)strtoul(digits, NULL, 16) == crc;
}

/// Removes the CRC from a line of JSON; false: it does not match.
static bool take_json_crc(char *line) {
    const size_t length = strlen(line);
    const size_t bytes = sizeof json_mark - 1 + CRC_DIGITS + 2;
    char *mark = length > bytes ? line + length - bytes : NULL;
    if (mark == NULL || strncmp(mark, json_mark, sizeof json_mark - 1) != 0 ||
        strcmp(line + length - 2, "\"}") != 0 ||
        !is_crc(mark + sizeof json_mark - 1, crc_update(0, line, (size_t)(mark - line)))) {
        return false;
    }
    strcpy(mark, "}");
    return true;
}

static void record_damage(struct answer *self) {
    self->damaged = true;
    self->ever_damaged = true;
    self->length = 0;
}

/// Keeps the answer itself, which is the last line; of progress, what it waits for.
static void keep_answer(struct remote *self, void *cookie, const char *text) {
    char what[REMOTE_STEP_BYTES];
    (void)cookie;
    cJSON_Delete(self->answer);
    self->answer = json_parse(text);
    if (json_member_text(self->answer, "what", what, sizeof what)) {
        remote_keep_step(self, what);
    }
}

/// Erases the progress of this command; that of a transfer stays.
static void erase_progress(const struct answer *self) {
    if (self->show != keep_answer) {
        remote_progress(self->remote, "", 0, 0);
    }
}

static void show_line(struct answer *self, const char *line) {
    erase_progress(self);
    self->show(self->remote, self->cookie, line);
}

/// Shows the kept lines, now verified.
static void show_lines(struct answer *self) {
    for (size_t at = 0; at < self->length; at += strlen(self->text + at) + 1) {
        show_line(self, self->text + at);
    }
    self->length = 0;
}

/// Whether a successful watch may have lost rounds.
static bool needs_rounds(const struct answer *self) {
    return self->rounds && self->ever_damaged;
}

/// Keeps a line until its CRC arrives with the last line.
static void keep_line(struct answer *self, const char *line) {
    const size_t bytes = strlen(line) + 1;
    if (bytes > REMOTE_LINE_BYTES - self->length) {
        record_damage(self);
        return;
    }
    memcpy(self->text + self->length, line, bytes);
    self->length += bytes;
}

/// CRC-32 of the kept lines, which end in line feeds.
static uint32_t crc_of_lines(const struct answer *self) {
    uint32_t crc = 0;
    for (size_t at = 0; at < self->length;) {
        const size_t bytes = strlen(self->text + at);
        crc = crc_update(crc, self->text + at, bytes);
        crc = crc_update(crc, "\n", 1);
        at += bytes + 1;
    }
    return crc;
}

static enum outcome outcome_of_text(const char *line) {
    if (strncmp(line, "OK", 2) == 0 && (line[2] == '\0' || line[2] == ' ')) {
        return ANSWERED_OK;
    }
    return strncmp(line, "ERR ", 4) == 0 ? ANSWERED_ERR : GOES_ON;
}

/// Processes a line of a text answer.
static enum outcome receive_text(struct answer *self, char *line) {
    if (remote_show_progress(self->remote, line)) {
        return GOES_ON;
    }
    if (!self->remote->line.serial) {
        show_line(self, line);
        return outcome_of_text(line);
    }
    const size_t length = strlen(line);
    char *const mark = length >= CRC_DIGITS + 2 ? line + length - CRC_DIGITS - 2 : line;
    if (strncmp(mark, " #", 2) != 0 || strspn(mark + 2, "0123456789ABCDEFabcdef") != CRC_DIGITS) {
        keep_line(self, line);
        return GOES_ON;
    }
    if (!is_crc(mark + 2, crc_update(crc_of_lines(self), line, (size_t)(mark + 2 - line)))) {
        record_damage(self);
        return GOES_ON;
    }
    *mark = '\0';
    const bool round = line[0] == '\0';
    show_lines(self);
    self->rounds = self->rounds || round;
    const enum outcome answered = strcmp(line, "OK") == 0 ? ANSWERED_OK : ANSWERED_ERR;
    const enum outcome outcome = round ? GOES_ON : answered;
    if (outcome != ANSWERED_OK || !needs_rounds(self)) {
        show_line(self, line);
    }
    return outcome;
}

/// Processes a line of a JSON answer.
static enum outcome receive_json(struct answer *self, char *line) {
    const bool serial = self->remote->line.serial;
    struct cJSON *all = !serial || take_json_crc(line) ? json_parse(line) : NULL;
    char event[32] = "";
    const bool valid = all != NULL;
    const bool ok = json_member_true(all, "ok");
    json_member_text(all, "event", event, sizeof event);
    cJSON_Delete(all);
    if (!valid) {
        record_damage(self);
        return serial ? GOES_ON : INVALID;
    }
    self->rounds = self->rounds || strcmp(event, "watch") == 0;
    if (!ok || !needs_rounds(self)) {
        show_line(self, line);
    }
    const enum outcome answered = ok ? ANSWERED_OK : ANSWERED_ERR;
    return event[0] != '\0' ? GOES_ON : answered;
}

/// Skips a late "OK" to "@framed", and its echo. That of an answer has a CRC.
static bool skip_greeting(struct answer *self, const char *text) {
    if (!self->remote->line.serial || strcmp(text, "OK") != 0) {
        return false;
    }
    self->length = 0;
    self->damaged = false;
    return true;
}

/// Receives a line of the answer.
static enum outcome receive_line(struct answer *self) {
    const bool serial = self->remote->line.serial;
    char *text = NULL;
    const int silence_ms = self->damaged ? FRAMING_QUIET_MS : SILENCE_MS;
    const int error = remote_receive(self->remote, serial ? silence_ms : REMOTE_FOREVER_MS, &text);
    if (error != ERROR_OK) {
        return error == ERROR_DEVICE ? BROKEN : UNANSWERED;
    }
    if (skip_greeting(self, text)) {
        return GOES_ON;
    }
    const int part = remote_receive_part(self->remote, self->cookie, text);
    if (part != 0) {
        return part > 0 ? GOES_ON : part == ERROR_DEVICE ? BROKEN : INVALID;
    }
    if (serial && strstr(text, FRAMING_DAMAGED) != NULL) {
        return NOT_RECEIVED;
    }
    return self->json ? receive_json(self, text) : receive_text(self, text);
}

/// Receives the answer; over a serial line as long as keepalives arrive.
static enum outcome receive(struct answer *self) {
    const struct remote_line *line = &self->remote->line;
    enum outcome outcome = GOES_ON;
    uint64_t from = line->rx_bytes;
    self->length = 0;
    self->damaged = false;
    while (outcome == GOES_ON) {
        outcome = receive_line(self);
        if (line->serial && outcome == GOES_ON && line->rx_bytes - from > GARBAGE_BYTES) {
            return UNANSWERED;
        }
        from = self->rounds && !self->damaged ? line->rx_bytes : from;
    }
    return outcome;
}

/// Waits until a serial line is quiet, so that no answer to an earlier request can follow. False:
/// connection lost.
static bool drain(struct remote *remote) {
    int error = 0;
    while (error == ERROR_OK) {
        char *text = NULL;
        error = remote_receive(remote, FRAMING_QUIET_MS, &text);
    }
    return error == ERROR_TIMEOUT;
}

/// Whether there is nothing to gain by sending the request again.
static bool is_final(enum outcome outcome, bool may_repeat) {
    return outcome != NOT_RECEIVED && (outcome != UNANSWERED || !may_repeat);
}

/// Sends the request once and receives its answer. `perhaps`: it may have been executed.
static enum outcome attempt(struct answer *self, const char *request, bool *perhaps) {
    if (!remote_line_send(&self->remote->line, request, strlen(request))) {
        return BROKEN;
    }
    const enum outcome outcome = receive(self);
    *perhaps = *perhaps || outcome == UNANSWERED || outcome == BROKEN;
    return outcome;
}

/// Sends the request until its outcome is known, or the peer is gone.
static enum outcome repeat(struct answer *self, const char *request, bool may_repeat,
                           bool *perhaps) {
    struct remote *remote = self->remote;
    enum outcome outcome = UNANSWERED;
    int silent = 0;
    bool pending = false;  // an earlier attempt may still be answered
    for (int i = 0; i < TRIES && silent < SILENT_TRIES && !remote_interrupted(remote); i++) {
        const uint64_t before = remote->line.rx_bytes;
        outcome = attempt(self, request, perhaps);
        silent = remote->line.rx_bytes == before ? silent + 1 : 0;
        if (is_final(outcome, may_repeat)) {
            if (pending) {
                (void)drain(remote);  // the first of two answers to one request counts
            }
            return outcome;
        }
        // A damaged line may have become two, each with its answer.
        if (outcome == NOT_RECEIVED && !drain(remote)) {
            return BROKEN;
        }
        pending = pending || (outcome == UNANSWERED && !self->damaged);
    }
    return outcome;
}

static int conclude(const struct answer *self, enum outcome outcome, bool perhaps,
                    struct message *message) {
    const char *const doubt = perhaps && self->remote->line.serial
                                  ? "; it is unknown whether the command was executed"
                                  : "";
    if (outcome == ANSWERED_OK && needs_rounds(self)) {
        return message_set(message, ERROR_CRC,
                           "rounds of the watch may be missing: the line damages data");
    }
    switch (outcome) {
        case ANSWERED_OK:
            return 0;
        case ANSWERED_ERR:
            return 1;
        case BROKEN:
            return message_set(message, ERROR_DEVICE, "connection lost%s", doubt);
        case INVALID:
            return message_set(message, ERROR_VERSION, "invalid answer from vergenced");
        default:
            return self->remote->interrupted
                       ? message_set(message, ERROR_CANCELLED, "interrupted%s", doubt)
                       : message_set(message, ERROR_TIMEOUT,
                                     "no undamaged answer arrives over the line%s", doubt);
    }
}

static int ask(struct answer *self, const char *command, bool may_repeat, struct message *message) {
    char request[REMOTE_REQUEST_BYTES];
    bool perhaps = false;
    if (!make_request(self, command, request)) {
        return message_set(message, ERROR_SYNTAX, "command too long");
    }
    self->text = malloc(REMOTE_LINE_BYTES);
    if (self->text == NULL) {
        return message_set(message, ERROR_MEMORY, "out of memory");
    }
    const enum outcome outcome = repeat(self, request, may_repeat, &perhaps);
    erase_progress(self);
    free(self->text);
    return conclude(self, outcome, perhaps, message);
}

/// Whether a command only reads, so that it may be executed again.
static bool only_reads(const char *command) {
    static const char *const names[] = {"complete", "config", "files",  "health",  "help",
                                        "log",      "status", "system", "version", "view"};
    const size_t bytes = strcspn(command, " ");
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strlen(names[i]) == bytes && strncmp(command, names[i], bytes) == 0) {
            return true;
        }
    }
    return false;
}

int remote_ask(struct remote *self, const char *command, remote_show *show, void *cookie,
               struct message *message) {
    struct answer answer = {.remote = self, .json = self->json, .show = show, .cookie = cookie};
    self->step[0] = '\0';
    return ask(&answer, command, only_reads(command), message);
}

int remote_call(struct remote *self, const char *command, const struct cJSON **result,
                struct message *message) {
    struct answer answer = {.remote = self, .json = true, .show = keep_answer};
    char name[32] = "", text[512] = "";
    self->refused = false;
    const int asked = ask(&answer, command, true, message);
    *result = cJSON_GetObjectItemCaseSensitive(self->answer, "result");
    if (asked <= 0) {
        return asked;
    }
    json_member_text(self->answer, "error", name, sizeof name);
    json_member_text(self->answer, "message", text, sizeof text);
    if (self->interrupted && strcmp(name, error_name(ERROR_CANCELLED)) == 0) {
        return message_set(message, ERROR_CANCELLED, "interrupted");
    }
    self->refused = true;
    return message_set(message, ERROR_REFUSED, "%s %s", name, text);
}
