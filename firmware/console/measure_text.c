// SPDX-License-Identifier: Apache-2.0
#include "console/measure_text.h"

#include <math.h>

#include "core/error.h"
#include "core/invariant.h"

const char *measure_phase_text(enum measure_phase phase) {
    static const char *const texts[MEASURE_PHASES] = {
#define TEXT(name, seconds, text) text,
        MEASURE_PHASE_LIST(TEXT)
#undef TEXT
    };
    INVARIANT((unsigned)phase < MEASURE_PHASES);
    return texts[phase];
}

const char *measure_why_text(enum measure_why why) {
    static const char *const texts[MEASURE_WHYS] = {
#define TEXT(name, text) text,
        MEASURE_WHY_LIST(TEXT)
#undef TEXT
    };
    INVARIANT((unsigned)why < MEASURE_WHYS);
    return texts[why];
}

const char *measure_loss_text(enum measure_loss loss) {
    static const char *const texts[MEASURE_LOSSES] = {
#define TEXT(name, text) text,
        MEASURE_LOSS_LIST(TEXT)
#undef TEXT
    };
    INVARIANT((unsigned)loss < MEASURE_LOSSES);
    return texts[loss];
}

const char *measure_advice_text(enum measure_advice advice) {
    static const char *const texts[MEASURE_ADVICES] = {
#define TEXT(name, text) text,
        MEASURE_ADVICE_LIST(TEXT)
#undef TEXT
    };
    INVARIANT((unsigned)advice < MEASURE_ADVICES);
    return texts[advice];
}

// Three digits, as figures of a measurement have.
static void add_figure(struct command_text *text, double value) {
    const double size = value < 0 ? -value : value;
    if (isinf(value)) {
        command_text_add(text, "infinity");
        return;
    }
    command_text_add_number(text, value, command_text_decimals(size));
}

void measure_text_add_step(struct command_text *text, const struct measure_step *step) {
    unsigned number = 0;
    command_text_join(text, measure_phase_text(step->phase), ": ");
    for (const char *at = measure_why_text(step->reason.why); *at != '\0'; at++) {
        const char letter[2] = {*at, '\0'};
        if (*at == '#' && number < MEASURE_NUMBERS) {
            add_figure(text, step->reason.number[number++]);
        } else {
            command_text_add(text, letter);
        }
    }
}

static void add_losses(struct command_text *text, uint32_t losses) {
    for (unsigned loss = 0; loss < MEASURE_LOSSES; loss++) {
        if ((losses >> loss & 1) != 0) {
            command_text_join(text, "; ", measure_loss_text((enum measure_loss)loss));
        }
    }
}

// "no texture: nothing to match" as "no texture".
static void add_hole(struct command_text *text, const char *why) {
    if (why != NULL) {
        command_text_add(text, ", holes mostly: ");
        for (; *why != '\0' && *why != ':'; why++) {
            const char letter[2] = {*why, '\0'};
            command_text_add(text, letter);
        }
    }
}

void measure_text_add_result(struct command_text *text, const struct measure_result *result,
                             const char *why) {
    if (result->error != ERROR_OK) {
        command_text_add(text, "no surface: ");
        if (result->phase != MEASURE_SURFACE) {
            command_text_join(text, measure_phase_text(result->phase), ": ");
        }
        command_text_add(text, why[0] != '\0' ? why : error_text(result->error));
    } else {
        command_text_add(text, "points good to ");
        add_figure(text, result->sigma_mm);
        command_text_add(text, " mm at ");
        add_figure(text, result->depth_mm);
        if (result->common_mm >= 0) {
            command_text_add(text, " mm, all depths together to ");
            add_figure(text, result->common_mm);
        }
        command_text_add(text, " mm; ");
        add_figure(text, 100 * result->share);
        command_text_add(text, " % of the subject measured");
        add_hole(text, result->hole);
    }
    add_losses(text, result->losses);
    if (result->advice != MEASURE_ADVICE_NOTHING) {
        command_text_join(text, "; better: ", measure_advice_text(result->advice));
        if (result->advised_mm > 0) {
            command_text_add(text, ": ");
            add_figure(text, result->common_mm);
            command_text_add(text, " -> ");
            add_figure(text, result->advised_mm);
            command_text_add(text, " mm");
        }
    }
}
