// SPDX-License-Identifier: Apache-2.0
/// Rate limit of the log: a script that repeats a failing command would fill the disk and push out
/// all other lines. Lines that differ only in digits are of one kind. Eight lines of a kind pass at
/// once, then one in ten minutes, with the number of those suppressed.
///
/// Not thread-safe: the caller locks.
#ifndef VERGENCE_DAEMON_SERVER_LOG_RATELIMIT_H
#define VERGENCE_DAEMON_SERVER_LOG_RATELIMIT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { LOG_RATELIMIT_KINDS = 64, LOG_RATELIMIT_BURST = 8, LOG_RATELIMIT_REFILL_US = 600 * 1000000 };

struct log_ratelimit_kind {
    uint32_t hash;
    unsigned left;         ///< lines that may pass now
    uint64_t refilled_us;  ///< when `left` last grew
    uint64_t last_us;      ///< when the last one came; 0: the entry is free
    uint64_t held;         ///< suppressed since the last one that passed
};

/// The caller zeroes it before the first use.
struct log_ratelimit {
    struct log_ratelimit_kind kinds[LOG_RATELIMIT_KINDS];
};

enum log_ratelimit_verdict {
    LOG_RATELIMIT_DROP,  ///< suppress the line
    LOG_RATELIMIT_PASS,
    LOG_RATELIMIT_PASS_LAST,  ///< pass it; the next ones of its kind are suppressed
};

/// Decides about a line that comes now. `now_us`: monotonic clock, not 0. For a line that passes,
/// `*held` receives the number of its kind that were suppressed before it; else it is unchanged.
enum log_ratelimit_verdict log_ratelimit_check(struct log_ratelimit *self, const char *text,
                                               uint64_t now_us, uint64_t *held);

#ifdef __cplusplus
}
#endif

#endif
