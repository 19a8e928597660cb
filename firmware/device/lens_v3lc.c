// SPDX-License-Identifier: Apache-2.0
#include "device/lens_v3lc.h"

#include "core/error.h"
#include "core/invariant.h"

enum {
    LINE_MAX = 16,  // the longest is "\n1Z850\n"
    PIECE = 64,
    UNANSWERED_MAX = 100,
    // Invalid data must not make questions come faster than the line can carry answers.
    MIN_GAP_US = 100000,
    BITS_PER_BYTE = 10,  // 8 data bits, a start bit and a stop bit
    US_PER_S = 1000000,
    TIMEOUT_MORE_US = 100000,
};

_Static_assert(sizeof(struct lens_v3lc) <= LENS_STATE_BYTES, "the state does not fit");

struct lens_v3lc *lens_v3lc_state(struct lens_controller *controller) {
    struct lens_v3lc *self = (void *)controller->state.bytes;
    if (self->controller != controller) {
        *self = (struct lens_v3lc){
            .controller = controller,
            .single = controller->driver->lenses == 1,
            .timeout_us = LENS_V3LC_TIMEOUT_MIN_US,
        };
    }
    return self;
}

static const struct hal_uart *uart_of(const struct lens_v3lc *self) {
    return self->controller->ports.uart;
}

static uint64_t now_us(const struct lens_v3lc *self) {
    const struct hal_clock *clock = self->controller->ports.clock;
    return clock->operations->now_us(clock->self);
}

static bool has_axis(const struct lens_v3lc *self, unsigned axis) {
    return (self->controller->driver->abilities.axes >> axis & 1) != 0;
}

// The line sends bytes one after the other.
static void note_sent(struct lens_v3lc *self, size_t bytes) {
    const uint32_t bits_per_s = self->controller->settings->bits_per_s;
    const uint64_t from_us = self->sent_us > now_us(self) ? self->sent_us : now_us(self);
    INVARIANT(bits_per_s > 0);
    self->sent_us = from_us + (uint64_t)bytes * BITS_PER_BYTE * US_PER_S / bits_per_s;
}

// Sends "<lens><text>\n", with `number` after the text unless it is negative.
static int send(struct lens_v3lc *self, unsigned lens, char text, int32_t number,
                uint64_t deadline_us) {
    INVARIANT(number <= self->controller->driver->position_max);
    char line[LINE_MAX];
    size_t length = 0;
    if (self->broken) {
        line[length++] = '\n';
    }
    if (!self->single) {
        line[length++] = (char)('1' + lens);
    }
    line[length++] = text;
    if (number >= 0) {
        // Three digits, as in the public code.
        line[length++] = (char)('0' + number / 100);
        line[length++] = (char)('0' + number / 10 % 10);
        line[length++] = (char)('0' + number % 10);
    }
    line[length++] = '\n';
    INVARIANT(length <= sizeof line);
    self->broken = true;  // set until the write is known to be complete
    note_sent(self, length);
    const int error =
        uart_of(self)->operations->write(uart_of(self)->self, line, length, deadline_us);
    self->broken = error != ERROR_OK;
    return error;
}

// ---- questions

// `again`: the previous question may still be answered, and that answer is accepted.
static int ask(struct lens_v3lc *self, unsigned number, bool again, uint64_t deadline_us) {
    struct lens_v3lc_lens *lens = &self->lenses[number];
    if (!again) {  // data received so far does not belong to a present question
        const int error = uart_of(self)->operations->discard(uart_of(self)->self);
        if (error != ERROR_OK) {
            return error;
        }
        self->answer = (struct lens_v3lc_answer){.begun = false};
        lens->unanswered = 0;
    }
    const uint64_t time_us = now_us(self);
    const int error = send(self, number, '?', -1, deadline_us);
    if (error != ERROR_OK) {
        return error;
    }
    lens->first_us = lens->unanswered == 0 && !again ? time_us : lens->first_us;
    lens->last_us = self->quiet_us = time_us;
    lens->asked_us = self->sent_us;
    lens->unanswered = (uint8_t)(lens->unanswered + (lens->unanswered < UNANSWERED_MAX ? 1 : 0));
    self->waiting = true;
    self->corrupted = false;
    self->lens = (uint8_t)number;
    self->counts.asked++;
    return ERROR_OK;
}

static bool plausible(const struct lens_v3lc *self) {
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        const struct lens_axis_settings *range = &self->controller->settings->axis[axis];
        const int32_t value = self->answer.values[axis];
        if (has_axis(self, axis) &&
            (value < range->min - LENS_V3LC_BEYOND || value > range->max + LENS_V3LC_BEYOND)) {
            return false;
        }
    }
    return true;
}

static void learn_timeout(struct lens_v3lc *self, uint64_t took_us) {
    uint64_t wanted_us = 2 * took_us + TIMEOUT_MORE_US;
    if (wanted_us < LENS_V3LC_TIMEOUT_MIN_US) {
        wanted_us = LENS_V3LC_TIMEOUT_MIN_US;
    }
    if (wanted_us > LENS_V3LC_TIMEOUT_MAX_US) {
        wanted_us = LENS_V3LC_TIMEOUT_MAX_US;
    }
    self->timeout_us = (uint32_t)wanted_us;
}

// A complete answer has arrived.
static void take_answer(struct lens_v3lc *self) {
    struct lens_v3lc_lens *lens = &self->lenses[self->answer.number];
    lens->unanswered = (uint8_t)(lens->unanswered - (lens->unanswered > 0 ? 1 : 0));
    if (!self->waiting || self->answer.number != self->lens) {
        self->counts.late++;
        return;
    }
    if (!plausible(self)) {
        self->counts.garbage++;
        self->corrupted = true;
        return;
    }
    const bool only = lens->unanswered == 0;  // else it is not known which question this answers
    lens->sampled_us = only ? lens->asked_us + self->controller->driver->sample_us : 0;
    if (only) {
        learn_timeout(self, now_us(self) - lens->last_us);
    }
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        lens->accepted[axis] = has_axis(self, axis) ? self->answer.values[axis] : (int16_t)0;
    }
    lens->accepted_us = lens->first_us;
    lens->fresh = true;
    self->waiting = false;
    self->counts.answered++;
}

// An invalid line has arrived.
static void take_garbage(struct lens_v3lc *self) {
    struct lens_v3lc_lens *lens = &self->lenses[self->lens];
    lens->unanswered = (uint8_t)(lens->unanswered - (lens->unanswered > 0 ? 1 : 0));
    self->counts.garbage++;
    self->corrupted = true;
}

// Receives until `until_us`, at least one byte.
static int listen(struct lens_v3lc *self, uint64_t until_us) {
    uint8_t bytes[PIECE];
    size_t count = 0;
    const int error =
        uart_of(self)->operations->read(uart_of(self)->self, bytes, sizeof bytes, until_us, &count);
    self->heard_us = now_us(self);
    if (error != ERROR_OK) {
        return error == ERROR_TIMEOUT ? ERROR_OK : error;
    }
    INVARIANT(count <= sizeof bytes);
    self->quiet_us = self->last_rx_us = self->heard_us;
    for (size_t i = 0; i < count; i++) {
        switch (lens_v3lc_answer_take(&self->answer, self->single, bytes[i])) {
            case LENS_V3LC_ANSWER:
                take_answer(self);
                break;
            case LENS_V3LC_GARBAGE:
                take_garbage(self);
                break;
            case LENS_V3LC_NOTHING:
                break;
        }
    }
    return ERROR_OK;
}

// Deadline of the questions to a lens: the line was quiet for the timeout. If the line is never
// quiet, the wait still ends.
static uint64_t timeout_at_us(const struct lens_v3lc *self, const struct lens_v3lc_lens *lens) {
    const uint64_t since_us = self->quiet_us > lens->last_us ? self->quiet_us : lens->last_us;
    const uint64_t quiet_us = since_us + self->timeout_us;
    const uint64_t max_us = lens->last_us + LENS_V3LC_TIMEOUT_MAX_US;
    return quiet_us < max_us ? quiet_us : max_us;
}

// If a question was not answered in time, the next one gets more time.
static void note_silence(struct lens_v3lc *self) {
    if (!self->waiting || self->corrupted) {
        return;
    }
    self->counts.silent++;
    self->timeout_us = 2 * self->timeout_us < LENS_V3LC_TIMEOUT_MAX_US
                           ? 2 * self->timeout_us
                           : (uint32_t)LENS_V3LC_TIMEOUT_MAX_US;
    self->broken = true;  // the controller may be waiting for the end of a line
}

// Whether the question to the other lens may still be answered: a question now would disturb that.
static bool other_is_due(const struct lens_v3lc *self, unsigned number) {
    return self->waiting && self->lens != number && !self->corrupted &&
           now_us(self) < timeout_at_us(self, &self->lenses[self->lens]);
}

// Listens for an answer, or asks when the time for it has passed.
static int listen_or_ask(struct lens_v3lc *self, unsigned number, uint64_t deadline_us) {
    if (other_is_due(self, number)) {
        const uint64_t until_us = timeout_at_us(self, &self->lenses[self->lens]);
        return listen(self, until_us < deadline_us ? until_us : deadline_us);
    }
    const struct lens_v3lc_lens *lens = &self->lenses[number];
    self->waiting &= self->lens == number;
    self->lens = (uint8_t)number;
    const bool again = self->waiting;
    const bool open = again || lens->unanswered > 0;
    const uint64_t until_us =
        again && self->corrupted ? lens->last_us + MIN_GAP_US : timeout_at_us(self, lens);
    // After a pause of the caller the answer may have arrived long ago.
    if (open && (now_us(self) < until_us || self->heard_us < until_us)) {
        return listen(self, until_us < deadline_us ? until_us : deadline_us);
    }
    note_silence(self);
    return ask(self, number, again, deadline_us);
}

// Repeats the question until a valid answer arrives. At a deadline the state is kept, so that the
// next call continues.
static int converse(struct lens_v3lc *self, unsigned number, uint64_t deadline_us) {
    while (!self->lenses[number].fresh) {
        const int error = listen_or_ask(self, number, deadline_us);
        if (error != ERROR_OK) {
            return error;
        }
        if (!self->lenses[number].fresh && now_us(self) >= deadline_us) {
            return ERROR_TIMEOUT;
        }
    }
    self->lenses[number].fresh = false;
    return ERROR_OK;
}

// ---- operations

static int read(struct lens_controller *controller, unsigned number, uint64_t deadline_us,
                struct lens_reading *readings) {
    struct lens_v3lc *self = lens_v3lc_state(controller);
    const struct lens_v3lc_lens *lens = &self->lenses[number];
    const int error = converse(self, number, deadline_us);
    for (unsigned axis = 0; axis < LENS_AXES && error == ERROR_OK; axis++) {
        readings[axis] = (struct lens_reading){
            .position = lens->accepted[axis],
            .time_us = lens->accepted_us,
            .sampled_us = lens->sampled_us,
        };
    }
    return error;
}

static int open(struct lens_controller *controller, unsigned number, uint64_t deadline_us) {
    struct lens_v3lc *self = lens_v3lc_state(controller);
    struct lens_reading readings[LENS_AXES];
    // The public V1LC code begins with T255, whose effect is not known.
    static const char greeting[] = {'\n', 'T', '2', '5', '5', '\n'};
    self->waiting &= self->lens == number;
    if (!self->waiting) {
        note_sent(self, sizeof greeting);
    }
    const int error = self->waiting
                          ? ERROR_OK
                          : uart_of(self)->operations->write(uart_of(self)->self, greeting,
                                                             sizeof greeting, deadline_us);
    return error == ERROR_OK ? read(controller, number, deadline_us, readings) : error;
}

static int go_to_position(struct lens_controller *controller, unsigned number, enum lens_axis axis,
                          int32_t position, uint64_t deadline_us) {
    static const char commands[LENS_AXES] = {'Z', 'F', 'I'};
    return send(lens_v3lc_state(controller), number, commands[axis], position, deadline_us);
}

static uint64_t last_rx(const struct lens_controller *controller) {
    const struct lens_v3lc *self = (const void *)controller->state.bytes;
    return self->last_rx_us;
}

const struct lens_operations lens_v3lc_operations = {
    .open = open, .go = go_to_position, .read = read, .last_rx = last_rx};
