// SPDX-License-Identifier: Apache-2.0
#include "core/invariant.h"
#include "rig/rig.h"

const char *rig_part_text(enum rig_part part) {
    static const char *const texts[RIG_PARTS] = {
#define RIG_PART_TEXT(name, text) text,
        RIG_PART_LIST(RIG_PART_TEXT)
#undef RIG_PART_TEXT
    };
    INVARIANT((unsigned)part < RIG_PARTS);
    return texts[part];
}
