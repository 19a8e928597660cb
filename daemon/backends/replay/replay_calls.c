// SPDX-License-Identifier: Apache-2.0
#include <inttypes.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/backends/replay/replay.h"

#define WAIT_OVER_US 1000000u  // added by each clock read after the replay has ended
// Most clock reads between two lines of the log; a recording has a new time earlier.
#define READS_MAX 10000000u

// ---- the log

/// Reads the next line without its end. False: end of file, or a line that is too long.
static bool next_line(struct replay *self) {
    if (fgets(self->text, sizeof self->text, self->log) == NULL) {
        return false;
    }
    const size_t length = strlen(self->text);
    if (length == 0 || self->text[length - 1] != '\n') {
        return false;
    }
    self->text[length - 1] = '\0';
    return true;
}

static bool is_check(const char *text) {
    return strncmp(text, TRACE_CHECK, strlen(TRACE_CHECK)) == 0;
}

/// Counts the lines up to the last matching check, and the calls among them.
static int count_lines(struct replay *self, struct message *message) {
    uint32_t crc = 0, line = 0, calls = 0;
    while (next_line(self)) {
        line++;
        char check[sizeof TRACE_CHECK + SESSION_CRC_DIGITS + 1];
        snprintf(check, sizeof check, TRACE_CHECK "%08" PRIx32, crc);
        if (is_check(self->text)) {
            if (strcmp(self->text, check) != 0) {
                return message_set(message, ERROR_CRC, "%s/%s: checksum mismatch before line %u",
                                   self->session.path, SESSION_CALLS_NAME, line);
            }
            self->lines = line;
            self->calls = calls;
        }
        calls += strstr(self->text, TRACE_EQUALS) != NULL;
        crc = crc_update(crc, self->text, strlen(self->text));
        crc = crc_update(crc, "\n", 1);
    }
    if (self->lines == 0) {
        return message_set(message, ERROR_MISSING, "%s/%s: contains no complete record",
                           self->session.path, SESSION_CALLS_NAME);
    }
    rewind(self->log);
    return ERROR_OK;
}

static void stop_playing(struct replay *self, uint32_t line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static void stop_playing(struct replay *self, uint32_t line, const char *format, ...) {
    char why[MESSAGE_BYTES];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(why, sizeof why, format, arguments);
    va_end(arguments);
    self->ended = true;
    message_set(&self->last_error, 0, "%s/%s: line %u: %s", self->session.path, SESSION_CALLS_NAME,
                line, why);
}

/// Reads on to the next call, time or idling. A cancellation takes effect at once: the command that
/// was cancelled is the one that made the call before it.
static void read_ahead(struct replay *self) {
    INVARIANT(self->log != NULL && self->line <= self->lines);
    self->next = REPLAY_NOTHING;
    while (self->next == REPLAY_NOTHING && self->line < self->lines && next_line(self)) {
        self->line++;
        if (strcmp(self->text, TRACE_CANCEL) == 0) {
            if (self->cancel != NULL) {
                self->cancel(self->self);
            }
        } else if (strcmp(self->text, TRACE_IDLE) == 0) {
            self->next = REPLAY_IDLE;
        } else if (sscanf(self->text, "time %" SCNu64 " %u", &self->next_us, &self->next_reads) ==
                   2) {
            self->next = REPLAY_TIME;
        } else if (!is_check(self->text)) {
            self->next = REPLAY_CALL;
        }
    }
}

/// A manipulated recording must not make time run backwards, nor to its end.
static void advance(struct replay *self, uint64_t now_us) {
    if (now_us > self->now_us && now_us <= INT64_MAX) {
        self->now_us = now_us;
    }
    self->reads = 0;
}

static int wrong_answer(struct replay *self) {
    stop_playing(self, self->answer_line, "invalid answer to '%.300s'", self->answered);
    return ERROR_IO;
}

/// Parses a number and a following blank at the front of an answer.
static bool take_number(const char **text, int64_t *value) {
    char *end;
    *value = strtoll(*text, &end, 10);
    const bool taken = end != *text;
    *text = *end == ' ' ? end + 1 : end;
    return taken;
}

/// Takes the recorded answer to a call, after its time: `self->answered` is the call then. NULL if
/// the replay has ended or ends now.
static const char *answer_to(struct replay *self, const char *asked) {
    static const char *const others[] = {
        [REPLAY_TIME] = "the clock to be read", [REPLAY_IDLE] = "idling"};
    if (self->ended) {
        return NULL;
    }
    if (self->next == REPLAY_NOTHING) {
        self->ran_out = true;
        stop_playing(self, self->line, "the recording ends here, got '%.300s'", asked);
        return NULL;
    }
    if (self->next != REPLAY_CALL) {
        stop_playing(self, self->line, "expected %s, got '%.300s'", others[self->next], asked);
        return NULL;
    }
    char *call;
    const uint64_t now_us = strtoull(self->text, &call, 10);
    char *const equals = strstr(call, TRACE_EQUALS);
    if (equals == NULL || *call != ' ') {
        stop_playing(self, self->line, "not a call");
        return NULL;
    }
    INVARIANT(equals > call);
    *equals = '\0';
    if (strcmp(call + 1, asked) != 0) {
        stop_playing(self, self->line, "expected the call '%.300s', got '%.300s'", call + 1, asked);
        return NULL;
    }
    const size_t answer_at = (size_t)(equals - call - 1) + strlen(TRACE_EQUALS);
    memcpy(self->answered, call + 1, sizeof self->text - (size_t)(call + 1 - self->text));
    self->answer_line = self->line;
    INVARIANT(self->calls > 0);
    self->calls--;
    self->made++;
    advance(self, now_us);
    read_ahead(self);
    return self->answered + answer_at;
}

/// Makes a call, named as by printf: returns its recorded result code; the rest of the answer is in
/// `*rest`. ERROR_IO if the replay has ended.
static int ask(struct replay *self, const char **rest, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static int ask(struct replay *self, const char **rest, const char *format, ...) {
    char asked[TRACE_LINE_MAX + 1];
    int64_t code;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(asked, sizeof asked, format, arguments);
    va_end(arguments);
    *rest = answer_to(self, asked);
    if (*rest == NULL) {
        return ERROR_IO;
    }
    return take_number(rest, &code) && code <= 0 && code > INT32_MIN ? (int)code
                                                                     : wrong_answer(self);
}

/// The same for a call whose answer is one number, `min` to INT64_MAX, besides its code.
static int ask_number(struct replay *self, int code, const char *rest, int64_t min,
                      int64_t *value) {
    if (code != 0) {
        return code;
    }
    return take_number(&rest, value) && *value >= min && *value < INT64_MAX ? 0
                                                                            : wrong_answer(self);
}

// ---- clock

static uint64_t clock_now_us(void *context) {
    struct replay *self = context;
    if (self->ended) {
        return self->now_us += WAIT_OVER_US;
    }
    self->reads++;
    if (self->next == REPLAY_TIME && self->reads == self->next_reads) {
        advance(self, self->next_us);
        read_ahead(self);
    } else if (self->reads == READS_MAX) {
        stop_playing(self, self->line, "expected a call, got %u reads of the clock", READS_MAX);
    }
    return self->now_us;
}

static void clock_wait_until_us(void *context, uint64_t time_us) {
    const char *rest;
    (void)ask(context, &rest, TRACE_CLOCK_WAIT, time_us);
}

static bool clock_idle_is_due(void *context) {
    struct replay *self = context;
    if (self->ended || self->next != REPLAY_IDLE) {
        return false;
    }
    self->reads = 0;
    read_ahead(self);
    return true;
}

static const struct hal_clock_operations clock_operations = {clock_now_us, clock_wait_until_us,
                                                             clock_idle_is_due};

// ---- I2C

static int i2c_transfer(void *context, const struct hal_i2c_message *messages, size_t count,
                        uint64_t deadline_us, size_t *begun) {
    struct replay *self = context;
    char sent[TRACE_LINE_MAX + 1];
    const char *rest;
    int64_t clocked = 0;
    INVARIANT(count > 0 && count <= HAL_I2C_MESSAGES_MAX);
    trace_i2c(sent, messages, count);
    const int code = ask(self, &rest, TRACE_I2C_TRANSFER, deadline_us, sent);
    *begun = 0;
    if (self->ended) {
        return code;
    }
    if (!take_number(&rest, &clocked) || clocked < 0) {
        return wrong_answer(self);
    }
    *begun = (size_t)clocked;
    for (size_t i = 0; i < count && code == 0; i++) {
        if (messages[i].read) {
            if (trace_take_bytes(&rest, messages[i].data, messages[i].bytes) != messages[i].bytes) {
                return wrong_answer(self);
            }
            rest += *rest == ' ';
        }
    }
    return code;
}

static int i2c_lines(void *context, unsigned pulled, unsigned *high) {
    const char *rest;
    int64_t lines;
    const int asked = ask(context, &rest, TRACE_I2C_LINES, pulled);
    const int code = ask_number(context, asked, rest, 0, &lines);
    *high = code == 0 ? (unsigned)lines : *high;
    return code;
}

// ---- serial line

static int uart_write(void *context, const void *data, size_t bytes, uint64_t deadline_us) {
    const uint8_t *at = data;
    int code = 0;
    while (code == 0 && bytes > 0) {  // one call for each piece that the recorder writes
        const size_t some = bytes < TRACE_BYTES_MAX ? bytes : TRACE_BYTES_MAX;
        char sent[TRACE_LINE_MAX + 1];
        const char *rest;
        trace_put_bytes(sent, at, some);
        code = ask(context, &rest, TRACE_UART_WRITE, deadline_us, sent);
        at += some;
        bytes -= some;
    }
    return code;
}

static int uart_read(void *context, void *data, size_t capacity, uint64_t deadline_us,
                     size_t *bytes) {
    const size_t some = capacity < TRACE_BYTES_MAX ? capacity : TRACE_BYTES_MAX;
    const char *rest;
    INVARIANT(some > 0);
    const int code = ask(context, &rest, TRACE_UART_READ, deadline_us, some);
    if (code != 0) {
        return code;
    }
    const long came = trace_take_bytes(&rest, data, some);
    if (came <= 0) {
        return wrong_answer(context);
    }
    *bytes = (size_t)came;
    return 0;
}

static int uart_discard(void *context) {
    const char *rest;
    return ask(context, &rest, TRACE_UART_DISCARD);
}

static const struct hal_uart_operations uart_operations = {uart_write, uart_read, uart_discard};

// ---- lines

static int gpio_set(void *context, enum hal_gpio_line line, bool active) {
    const char *rest;
    return ask(context, &rest, TRACE_GPIO_SET, (int)line, active);
}

static int gpio_get(void *context, enum hal_gpio_line line, bool *active) {
    const char *rest;
    int64_t level;
    const int asked = ask(context, &rest, TRACE_GPIO_GET, (int)line);
    const int code = ask_number(context, asked, rest, 0, &level);
    *active = code == 0 ? level != 0 : *active;
    return code;
}

static const struct hal_gpio_operations gpio_operations = {gpio_set, gpio_get};

// ---- cameras

static int camera_start(void *context, const struct hal_camera_format *format) {
    const struct replay_camera *camera = context;
    const char *rest;
    return ask(camera->replay, &rest, TRACE_CAMERA_START, camera->number, format->width_px,
               format->height_px);
}

static int camera_stop(void *context) {
    const struct replay_camera *camera = context;
    const char *rest;
    return ask(camera->replay, &rest, TRACE_CAMERA_STOP, camera->number);
}

static int camera_take(void *context, uint64_t not_before_us, uint64_t deadline_us,
                       struct hal_camera_frame *frame) {
    struct replay_camera *camera = context;
    struct replay *self = camera->replay;
    const char *rest;
    int code = ask(self, &rest, TRACE_CAMERA_TAKE, camera->number, not_before_us, deadline_us);
    if (code != 0) {
        return code;
    }
    struct pair_frame form = {.sequence = 0};
    uint32_t crc32, faults;
    int width_px, height_px, bits, layout;
    const int values = sscanf(rest, TRACE_FRAME, &crc32, &width_px, &height_px, &bits, &layout,
                              &form.sequence, &faults, &form.begin_us, &form.end_us);
    if (values != TRACE_FRAME_VALUES || bits < 8 || bits > 16 || layout < 0 ||
        layout > RAW_BAYER_GRBG || width_px < 1 || width_px > UINT16_MAX || height_px < 1 ||
        height_px > UINT16_MAX) {
        return wrong_answer(self);
    }
    form.image = (struct raw_image){.width_px = width_px,
                                    .height_px = height_px,
                                    .bits = bits,
                                    .layout = (enum raw_layout)layout};
    code = replay_frame(camera, &form, crc32, frame);
    self->ended |= code != 0;
    frame->faults = faults;
    return code;
}

static int camera_control(void *context, enum hal_camera_control control, int32_t value,
                          int32_t *applied) {
    const struct replay_camera *camera = context;
    const char *rest;
    int64_t as_applied;
    const int asked =
        ask(camera->replay, &rest, TRACE_CAMERA_CONTROL, camera->number, (int)control, value);
    const int code = ask_number(camera->replay, asked, rest, INT32_MIN, &as_applied);
    *applied = code == 0 ? (int32_t)as_applied : *applied;
    return code;
}

static void camera_counts(void *context, struct hal_camera_counts *counts) {
    const struct replay_camera *camera = context;
    char asked[32];
    snprintf(asked, sizeof asked, TRACE_CAMERA_COUNTS, camera->number);
    const char *answer = answer_to(camera->replay, asked);
    memset(counts, 0, sizeof *counts);
    if (answer != NULL &&
        sscanf(answer, TRACE_COUNTS, &counts->frames, &counts->faulty, &counts->gaps,
               &counts->timeouts, &counts->restarts) != TRACE_COUNTS_VALUES) {
        wrong_answer(camera->replay);
    }
}

// ---- all together

static void set_camera(struct replay *self, int number, bool has_control) {
    INVARIANT(number == RIG_LEFT || number == RIG_RIGHT);
    self->camera_operations[number] = (struct hal_camera_operations){
        camera_start, camera_stop, camera_take, has_control ? camera_control : NULL, camera_counts};
    self->ports.camera[number] = &self->camera[number];
}

/// Sets the ports that existed.
static int set_ports(struct replay *self, struct message *message) {
    int i2c, lines, gpio, uart, cameras, controls[RIG_SIDES];
    const bool known = next_line(self) && strcmp(self->text, TRACE_FIRST_LINE) == 0;
    if (!known || !next_line(self) ||
        sscanf(self->text, TRACE_PORTS, &i2c, &lines, &gpio, &uart, &cameras, &controls[RIG_LEFT],
               &controls[RIG_RIGHT]) != TRACE_PORTS_VALUES) {
        return message_set(message, ERROR_SYNTAX, "%s/%s: does not begin with the ports",
                           self->session.path, SESSION_CALLS_NAME);
    }
    self->line = 2;
    self->clock = (struct hal_clock){&clock_operations, self};
    self->ports.clock = &self->clock;
    self->i2c_operations = (struct hal_i2c_operations){i2c_transfer, lines != 0 ? i2c_lines : NULL};
    self->i2c = (struct hal_i2c){&self->i2c_operations, self};
    self->gpio = (struct hal_gpio){&gpio_operations, self};
    self->uart = (struct hal_uart){&uart_operations, self};
    self->ports.i2c = i2c != 0 ? &self->i2c : NULL;
    self->ports.gpio = gpio != 0 ? &self->gpio : NULL;
    self->ports.lens_uart = uart != 0 ? &self->uart : NULL;
    if (cameras >= 1) {
        set_camera(self, RIG_LEFT, controls[RIG_LEFT] != 0);
        self->ports.camera[RIG_RIGHT] = self->ports.camera[RIG_LEFT];
    }
    if (cameras == 2) {
        set_camera(self, RIG_RIGHT, controls[RIG_RIGHT] != 0);
    }
    read_ahead(self);
    return ERROR_OK;
}

int replay_calls_open(struct replay *self, struct message *message) {
    INVARIANT(self->has_calls && self->log == NULL);
    self->log = session_reader_file(&self->session, SESSION_CALLS_NAME, message);
    if (self->log == NULL) {
        return ERROR_MISSING;
    }
    const int code = count_lines(self, message);
    return code != 0 ? code : set_ports(self, message);
}
