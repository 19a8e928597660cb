// SPDX-License-Identifier: Apache-2.0
/// The last captured pair, kept in memory so that a reconstruction needs no disk: one pair, and one
/// more while a reconstruction still uses an earlier one.
#ifndef VERGENCE_DAEMON_SESSION_LAST_PAIR_H
#define VERGENCE_DAEMON_SESSION_LAST_PAIR_H

#include <stdbool.h>
#include <stddef.h>

#include "daemon/session/session.h"
#include "stereo/geometry/calibration.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { CAPTURED_PAIR_NAME_BYTES = 201 };

/// A pair with everything that its session contains, or would contain. Unchanged once it is the
/// last pair.
struct captured_pair {
    struct pair pair;                     ///< owns its images; `number`: in its session
    char name[CAPTURED_PAIR_NAME_BYTES];  ///< name of its session, or made from the time of capture
    bool in_session;                      ///< the session exists
    char profile[SESSION_NAME_MAX + 1];   ///< profile of the instrument
    bool has_instrument;
    struct pair_instrument instrument;
    char calibration[CALIBRATION_TEXT_MAX_BYTES];  ///< calibration in force, in its canonical text
    size_t calibration_length;                     ///< 0: none
    bool calibration_own;  ///< made for this pair by a zoom calibration: its session gets it
    unsigned users;        ///< used by last_pair.c
};

/// Zeroed at the beginning. All functions may be called by any thread.
struct last_pair {
    struct captured_pair *pair;  ///< NULL: none
};

/// Replaces the last pair by `pair`, which was allocated by malloc and is taken over; NULL: forgets
/// it. The old one is freed once it is no longer in use.
void last_pair_set(struct last_pair *self, struct captured_pair *pair);

/// The last pair, to be given back by last_pair_give_back; NULL: none.
struct captured_pair *last_pair_use(struct last_pair *self);
void last_pair_give_back(struct captured_pair *pair);

#ifdef __cplusplus
}
#endif

#endif
