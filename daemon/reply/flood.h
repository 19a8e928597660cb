// SPDX-License-Identifier: Apache-2.0
/// Holds back lines of a log that come again and again: a script that repeats what fails would fill
/// the disk and push out all else. Lines are of one kind when they differ in their digits alone. Of
/// a kind eight are told at once, then one in ten minutes, with the number of those held back.
///
/// No lock of its own: the caller's.
#ifndef VERGENCE_DAEMON_REPLY_FLOOD_H
#define VERGENCE_DAEMON_REPLY_FLOOD_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FLOOD_KINDS = 64, FLOOD_AT_ONCE = 8, FLOOD_REFILL_US = 600 * 1000000 };

struct flood_kind {
    uint32_t hash;
    unsigned left;         ///< that may be told at once
    uint64_t refilled_us;  ///< when `left` last grew
    uint64_t last_us;      ///< when one came last; 0: the place is free
    uint64_t held;         ///< back, since one was told
};

/// Zeroed at the beginning.
struct flood {
    struct flood_kind kinds[FLOOD_KINDS];
};

enum flood_answer {
    FLOOD_HOLD,  ///< it is not to be told
    FLOOD_TELL,
    FLOOD_TELL_LAST,  ///< and no more of its kind for a while
};

/// What is to become of a line that comes now; `now_us` is of a clock that only goes forward, and
/// not 0. `*held` receives how many of its kind were held back before one that is told.
enum flood_answer flood_ask(struct flood *self, const char *text, uint64_t now_us, uint64_t *held);

#ifdef __cplusplus
}
#endif

#endif
