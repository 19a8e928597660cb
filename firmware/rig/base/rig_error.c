// SPDX-License-Identifier: Apache-2.0
#include "rig/base/rig_error.h"

#include "core/decimal.h"
#include "core/error.h"
#include "core/invariant.h"

enum rig_part rig_part_of(enum rig_part left, unsigned side) {
    INVARIANT(side < RIG_SIDES && (unsigned)left + side < RIG_PARTS);
    return (enum rig_part)((unsigned)left + side);
}

const char *rig_part_text(enum rig_part part) {
    static const char *const texts[RIG_PARTS] = {
#define RIG_PART_TEXT(name, text) text,
        RIG_PART_LIST(RIG_PART_TEXT)
#undef RIG_PART_TEXT
    };
    INVARIANT((unsigned)part < RIG_PARTS);
    return texts[part];
}

// A message under construction, limited to the size of its buffer.
struct sentence {
    char *text;
    size_t length;
};

static void add(struct sentence *sentence, const char *text) {
    const size_t room = sizeof((struct rig_error *)0)->text - 1;
    while (*text != '\0' && sentence->length < room) {
        sentence->text[sentence->length++] = *text++;
    }
    INVARIANT(sentence->length <= room);
    sentence->text[sentence->length] = '\0';
}

static void write_text(struct rig_error *last_error, enum rig_part part, const char *what,
                       const int32_t *numbers) {
    struct sentence sentence = {last_error->text, 0};
    add(&sentence, rig_part_text(part));
    add(&sentence, ": ");
    for (; *what != '\0'; what++) {
        char piece[DECIMAL_TEXT_BYTES] = {*what, '\0'};
        // Without numbers # is an ordinary character: the name of a device may contain it.
        if (*what == '#' && numbers != NULL) {
            decimal_print(*numbers++, 0, piece);
        }
        add(&sentence, piece);
    }
}

static int write_error(struct rig_error *last_error, enum rig_part part, int error,
                       const char *what, const int32_t *numbers) {
    INVARIANT(error < ERROR_OK);
    last_error->part = part;
    last_error->error = error;
    write_text(last_error, part, what, numbers);
    return error;
}

int rig_part_error(struct rig *self, enum rig_part part, int error, const char *what,
                   const int32_t *numbers) {
    return write_error(&self->last_error, part, error, what, numbers);
}

void rig_part_log(const struct rig *self, enum rig_part part, enum hal_log_level level,
                  const char *what) {
    const struct hal_log *log = self->ports.log;
    struct rig_error line;
    if (log != NULL) {
        write_text(&line, part, what, NULL);
        log->operations->write(log->self, level, line.text);
    }
}

int rig_part_failed(struct rig *self, enum rig_part part, int error, const char *what) {
    const struct rig_devices *devices = self->ports.devices;
    const char *missing = devices == NULL ? NULL : devices->missing(devices->self, part);
    return rig_part_error(self, part, error, missing != NULL ? missing : what, NULL);
}

int rig_reject(struct rig *self, enum rig_part part, int error, const char *what,
               const int32_t *numbers) {
    return write_error(&self->rejected, part, error, what, numbers);
}

static const char *words_of(int error) {
    switch (error) {
        case ERROR_I2C_NACK:
            return "no answer on I2C (check its supply, SCL and SDA)";
        case ERROR_I2C_STUCK:
        case ERROR_TIMEOUT:
            return "I2C bus stuck low (unplug devices one by one to find the culprit, then run "
                   "bringup)";
        case ERROR_I2C_ARBITRATION:
            return "I2C arbitration lost (remove any other master from the bus)";
        case ERROR_VERIFY:
            return "a written value does not read back (check the I2C cable and its grounds)";
        case ERROR_DEVICE:
            return "missing, or another device responds at its address (check what is connected)";
        case ERROR_RESTARTED:
            return "it has restarted and lost its settings (check its supply, then run bringup)";
        case ERROR_REFUSED:
            return "it rejects a setting (bitstream and program versions do not match)";
        case ERROR_UNSUPPORTED:
            return "its bitstream does not support a rig (load the bitstream for two cameras)";
        default:
            return "its I2C bus cannot be reached (see the system log)";
    }
}

int rig_bus_failed(struct rig *self, enum rig_part part, int error) {
    return rig_part_failed(self, part, error, words_of(error));
}
