// SPDX-License-Identifier: Apache-2.0
#include "daemon/reply/flood.h"

#include "core/crc.h"
#include "core/invariant.h"

static uint32_t hash_of(const char *text) {
    uint32_t hash = 0;
    for (const char *at = text; *at != '\0'; at++) {
        if (*at < '0' || *at > '9') {
            hash = crc_update(hash, at, 1);
        }
    }
    return hash;
}

/// The entry of this kind; a new kind replaces the one that was seen least recently.
static struct flood_kind *find(struct flood *self, uint32_t hash, uint64_t now_us) {
    struct flood_kind *oldest = &self->kinds[0];
    for (size_t i = 0; i < FLOOD_KINDS; i++) {
        struct flood_kind *kind = &self->kinds[i];
        if (kind->last_us != 0 && kind->hash == hash) {
            return kind;
        }
        oldest = kind->last_us < oldest->last_us ? kind : oldest;
    }
    *oldest = (struct flood_kind){.hash = hash, .left = FLOOD_AT_ONCE, .refilled_us = now_us};
    return oldest;
}

enum flood_answer flood_ask(struct flood *self, const char *text, uint64_t now_us, uint64_t *held) {
    INVARIANT(now_us > 0);
    struct flood_kind *kind = find(self, hash_of(text), now_us);
    const uint64_t more = (now_us - kind->refilled_us) / FLOOD_REFILL_US;
    kind->refilled_us += more * FLOOD_REFILL_US;
    kind->left = more >= FLOOD_AT_ONCE - kind->left ? FLOOD_AT_ONCE : kind->left + (unsigned)more;
    kind->last_us = now_us;
    if (kind->left == 0) {
        kind->held++;
        return FLOOD_HOLD;
    }
    kind->left--;
    *held = kind->held;
    kind->held = 0;
    return kind->left == 0 ? FLOOD_TELL_LAST : FLOOD_TELL;
}
