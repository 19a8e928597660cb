// SPDX-License-Identifier: Apache-2.0
// The texts of verdicts.
#include "core/invariant.h"
#include "focus/focus_search.h"

const char *focus_verdict_text(enum focus_verdict verdict) {
    static const char *const texts[FOCUS_VERDICTS] = {
#define FOCUS_VERDICT_TEXT(name, text, help) text,
        FOCUS_VERDICT_LIST(FOCUS_VERDICT_TEXT)
#undef FOCUS_VERDICT_TEXT
    };
    INVARIANT((unsigned)verdict < FOCUS_VERDICTS);
    return texts[verdict];
}

const char *focus_search_text(const struct focus_search *self) {
    const bool only_seen = self->options.curve_only && self->result.verdict == FOCUS_FOCUSED;
    return only_seen ? "one peak" : focus_verdict_text(self->result.verdict);
}

const char *focus_verdict_help(enum focus_verdict verdict) {
    static const char *const texts[FOCUS_VERDICTS] = {
#define FOCUS_VERDICT_HELP(name, text, help) help,
        FOCUS_VERDICT_LIST(FOCUS_VERDICT_HELP)
#undef FOCUS_VERDICT_HELP
    };
    INVARIANT((unsigned)verdict < FOCUS_VERDICTS);
    return texts[verdict];
}
