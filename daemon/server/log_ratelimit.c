// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/log_ratelimit.h"

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
static struct log_ratelimit_kind *find(struct log_ratelimit *self, uint32_t hash, uint64_t now_us) {
    struct log_ratelimit_kind *oldest = &self->kinds[0];
    for (size_t i = 0; i < LOG_RATELIMIT_KINDS; i++) {
        struct log_ratelimit_kind *kind = &self->kinds[i];
        if (kind->last_us != 0 && kind->hash == hash) {
            return kind;
        }
        oldest = kind->last_us < oldest->last_us ? kind : oldest;
    }
    *oldest = (struct log_ratelimit_kind){
        .hash = hash, .left = LOG_RATELIMIT_BURST, .refilled_us = now_us};
    return oldest;
}

enum log_ratelimit_verdict log_ratelimit_check(struct log_ratelimit *self, const char *text,
                                               uint64_t now_us, uint64_t *held) {
    INVARIANT(now_us > 0);
    struct log_ratelimit_kind *kind = find(self, hash_of(text), now_us);
    const uint64_t more = (now_us - kind->refilled_us) / LOG_RATELIMIT_REFILL_US;
    kind->refilled_us += more * LOG_RATELIMIT_REFILL_US;
    kind->left = more >= LOG_RATELIMIT_BURST - kind->left ? LOG_RATELIMIT_BURST
                                                          : kind->left + (unsigned)more;
    kind->last_us = now_us;
    if (kind->left == 0) {
        kind->held++;
        return LOG_RATELIMIT_DROP;
    }
    kind->left--;
    *held = kind->held;
    kind->held = 0;
    return kind->left == 0 ? LOG_RATELIMIT_PASS_LAST : LOG_RATELIMIT_PASS;
}
