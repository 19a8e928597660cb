// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/reason.h"

const char *reason_text(int reason) {
    switch (reason) {
#define REASON_CASE(name, number, text) \
    case REASON_##name:                 \
        return text;
        REASON_LIST(REASON_CASE)
#undef REASON_CASE
        default:
            return "unknown";
    }
}
