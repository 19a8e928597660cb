// SPDX-License-Identifier: Apache-2.0
// The texts of verdicts.
#include "core/invariant.h"
#include "focus/focus_search.h"

static const struct {
    const char *text, *help;
} verdicts[FOCUS_VERDICTS] = {
#define FOCUS_VERDICT_ROW(name, text, help) {text, help},
    FOCUS_VERDICT_LIST(FOCUS_VERDICT_ROW)
#undef FOCUS_VERDICT_ROW
};

const char *focus_verdict_text(enum focus_verdict verdict) {
    INVARIANT((unsigned)verdict < FOCUS_VERDICTS);
    return verdicts[verdict].text;
}

static const char *verdict_help(enum focus_verdict verdict) {
    INVARIANT((unsigned)verdict < FOCUS_VERDICTS);
    return verdicts[verdict].help;
}

const char *focus_search_help(const struct focus_search *self) {
    const struct focus_search_options *options = &self->options;
    const struct focus_result *result = &self->result;
    if (result->verdict != FOCUS_PEAK_AT_END) {
        return verdict_help(result->verdict);
    }
    return result->peak.position > (options->min + options->max) / 2
               ? "the subject is nearer than the lens can focus: move it away, or zoom out"
               : "the subject is farther than the lens can focus: zoom out or close the iris";
}

const char *focus_search_text(const struct focus_search *self) {
    const bool only_seen = self->options.curve_only && self->result.verdict == FOCUS_FOCUSED;
    return only_seen ? "one peak" : focus_verdict_text(self->result.verdict);
}
