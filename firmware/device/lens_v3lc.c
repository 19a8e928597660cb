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
    TIMEOUT_MORE_US = 100000,
    ALL_AXES = 1 << LENS_ZOOM | 1 << LENS_FOCUS | 1 << LENS_IRIS,
    SINGLE_AXES = 1 << LENS_ZOOM | 1 << LENS_FOCUS,
};

static uint64_t now_us(const struct lens_v3lc *self) {
    return self->clock->operations->now_us(self->clock->self);
}

static unsigned axes_of(const struct lens_v3lc *self) {
    return self->single ? SINGLE_AXES : ALL_AXES;
}

static struct lens_limits limits_of(const struct lens_v3lc *self) {
    return self->single ? (struct lens_limits){LENS_V1LC_MIN, LENS_V1LC_MAX}
                        : (struct lens_limits){LENS_V3LC_MIN, LENS_V3LC_MAX};
}

// Sends "<lens><text>\n", with `number` after the text unless it is negative.
static int send(struct lens_v3lc *self, unsigned lens, char text, int32_t number,
                uint64_t deadline_us) {
    INVARIANT(number <= LENS_V3LC_MAX);
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
    self->broken = true;  // until the write is known to be complete
    const int error = self->uart->operations->write(self->uart->self, line, length, deadline_us);
    self->broken = error != ERROR_OK;
    return error;
}

// ---- questions

// `again`: the previous question may still be answered, and that answer is accepted.
static int ask(struct lens_v3lc *self, unsigned number, bool again, uint64_t deadline_us) {
    struct lens_v3lc_lens *lens = &self->lenses[number];
    if (!again) {  // data received so far does not belong to a present question
        const int error = self->uart->operations->discard(self->uart->self);
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
    lens->unanswered = (uint8_t)(lens->unanswered + (lens->unanswered < UNANSWERED_MAX ? 1 : 0));
    self->waiting = true;
    self->corrupted = false;
    self->lens = (uint8_t)number;
    self->counts.asked++;
    return ERROR_OK;
}

static bool plausible(const struct lens_v3lc *self) {
    const struct lens_limits limits = limits_of(self);
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        const int32_t value = self->answer.values[axis];
        const bool beyond =
            value < limits.min - LENS_V3LC_BEYOND || value > limits.max + LENS_V3LC_BEYOND;
        if (beyond && (axes_of(self) & 1u << axis) != 0) {
            return false;
        }
    }
    return true;
}

static void learn_timeout(struct lens_v3lc *self, uint64_t took_us) {
    const uint64_t wanted_us = 2 * took_us + TIMEOUT_MORE_US;
    self->timeout_us = wanted_us < LENS_V3LC_TIMEOUT_MIN_US   ? LENS_V3LC_TIMEOUT_MIN_US
                       : wanted_us > LENS_V3LC_TIMEOUT_MAX_US ? LENS_V3LC_TIMEOUT_MAX_US
                                                              : (uint32_t)wanted_us;
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
    if (lens->unanswered == 0) {  // otherwise it is not known which question this answers
        learn_timeout(self, now_us(self) - lens->last_us);
    }
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        self->accepted[axis] = (axes_of(self) & 1u << axis) != 0 ? self->answer.values[axis] : 0;
    }
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
        self->uart->operations->read(self->uart->self, bytes, sizeof bytes, until_us, &count);
    if (error != ERROR_OK) {
        return error == ERROR_TIMEOUT ? ERROR_OK : error;
    }
    INVARIANT(count <= sizeof bytes);
    self->quiet_us = self->last_rx_us = now_us(self);
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

// Repeats the question until a valid answer arrives. At a deadline the state is kept, so that the
// next call continues.
static int converse(struct lens_v3lc *self, unsigned number, uint64_t deadline_us) {
    struct lens_v3lc_lens *lens = &self->lenses[number];
    self->waiting &= self->lens == number;
    self->lens = (uint8_t)number;
    bool answered = false;
    while (!answered) {
        const bool again = self->waiting;
        const bool open = again || lens->unanswered > 0;
        const uint64_t corrupted_us = lens->last_us + MIN_GAP_US;
        const uint64_t until_us =
            again && self->corrupted ? corrupted_us : timeout_at_us(self, lens);
        const uint64_t time_us = now_us(self);
        int error = ERROR_OK;
        if (time_us >= deadline_us) {
            return ERROR_TIMEOUT;
        }
        if (open && time_us < until_us) {
            error = listen(self, until_us < deadline_us ? until_us : deadline_us);
            answered = again && !self->waiting;
        } else {
            note_silence(self);
            error = ask(self, number, again, deadline_us);
        }
        if (error != ERROR_OK) {
            return error;
        }
    }
    return ERROR_OK;
}

// ---- abilities of a lens

static int read(void *self, uint64_t deadline_us, struct lens_reading *readings) {
    const struct lens_v3lc_lens *lens = self;
    const int error = converse(lens->controller, lens->number, deadline_us);
    if (error != ERROR_OK) {
        return error;
    }
    for (unsigned axis = 0; axis < LENS_AXES; axis++) {
        readings[axis] = (struct lens_reading){
            .position = lens->controller->accepted[axis],
            .moving = false,
            .time_us = lens->first_us,
        };
    }
    return ERROR_OK;
}

static int open(void *self, uint64_t deadline_us, struct lens_abilities *abilities) {
    const struct lens_v3lc_lens *lens = self;
    struct lens_v3lc *controller = lens->controller;
    struct lens_reading readings[LENS_AXES];
    // The public V1LC code begins with T255, whose effect is not known.
    static const char greeting[] = {'\n', 'T', '2', '5', '5', '\n'};
    const bool goes_on = controller->waiting && controller->lens == lens->number;
    int error = goes_on ? ERROR_OK
                        : controller->uart->operations->write(controller->uart->self, greeting,
                                                              sizeof greeting, deadline_us);
    if (error == ERROR_OK) {
        error = read(self, deadline_us, readings);
    }
    if (error == ERROR_OK) {
        *abilities = (struct lens_abilities){
            .reads_position = true,
            .axes = (uint8_t)axes_of(controller),
        };
    }
    return error;
}

static int limits(void *self, enum lens_axis axis, struct lens_limits *limits) {
    const struct lens_v3lc_lens *lens = self;
    if ((unsigned)axis >= LENS_AXES || (axes_of(lens->controller) & 1u << axis) == 0) {
        return ERROR_NOT_CONNECTED;
    }
    *limits = limits_of(lens->controller);
    return ERROR_OK;
}

static int go(void *self, enum lens_axis axis, int32_t position, uint64_t deadline_us) {
    static const char commands[LENS_AXES] = {'Z', 'F', 'I'};
    const struct lens_v3lc_lens *lens = self;
    struct lens_limits allowed = {0, 0};
    const int error = limits(self, axis, &allowed);
    if (error != ERROR_OK) {
        return error;
    }
    if (position < allowed.min || position > allowed.max) {
        return ERROR_RANGE;
    }
    return send(lens->controller, lens->number, commands[axis], position, deadline_us);
}

static int stop(void *self, uint64_t deadline_us) {
    (void)self;
    (void)deadline_us;
    return ERROR_UNSUPPORTED;
}

static uint64_t last_rx(const void *self) {
    const struct lens_v3lc_lens *lens = self;
    return lens->controller->last_rx_us;
}

void lens_v3lc_init(struct lens_v3lc *self, const struct hal_uart *uart,
                    const struct hal_clock *clock, bool single) {
    INVARIANT(uart != NULL && clock != NULL);
    *self = (struct lens_v3lc){
        .uart = uart,
        .clock = clock,
        .single = single,
        .timeout_us = LENS_V3LC_TIMEOUT_MIN_US,
    };
    for (unsigned number = 0; number < LENS_V3LC_LENSES; number++) {
        self->lenses[number].controller = self;
        self->lenses[number].number = (uint8_t)number;
    }
}

struct lens_drive lens_v3lc_lens(struct lens_v3lc *self, unsigned number) {
    static const struct lens_drive_operations operations = {open, limits, go, stop, read, last_rx};
    INVARIANT(number < LENS_V3LC_LENSES && (number == 0 || !self->single));
    return (struct lens_drive){.operations = &operations, .self = &self->lenses[number]};
}
