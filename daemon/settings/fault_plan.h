// SPDX-License-Identifier: Apache-2.0
/// Selects the calls that fail, by a script of one line:
///
///     i2c.transfer@5=i2c_nack          the fifth transfer fails
///     left.take@3+=timeout             the third frame and all later ones
///     store.*%0.01=io                  every call, each with a probability of 1 %
///     uart.write@2=timeout/after       the call is made, then reported as failed
///     uart.read@4=spoil                it succeeds with wrong bytes (frames: damaged)
///     seed=7                           seed of the probabilities, default 1
///
/// Rules are separated by commas or spaces. Parts and operations are those that fault.h wraps; a
/// camera that carries both sensors is "left". "*" means every part, or every operation of one.
/// Errors are those of core/error.h in lower case.
#ifndef VERGENCE_DAEMON_SETTINGS_FAULT_PLAN_H
#define VERGENCE_DAEMON_SETTINGS_FAULT_PLAN_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { FAULT_PLAN_RULES = 16, FAULT_PLAN_NAME_BYTES = 16 };

/// The effect on one call.
struct fault_plan_effect {
    int error;     ///< 0: none
    bool after;    ///< the call is made, and then `error` is returned
    bool corrupt;  ///< the call is made, and what it read is wrong
};

struct fault_plan_rule {
    char part[FAULT_PLAN_NAME_BYTES], operation[FAULT_PLAN_NAME_BYTES];
    uint32_t first;      ///< number of the first call that fails, from 1; 0: calls fail at random
    bool for_ever;       ///< all later calls fail, too
    uint32_t threshold;  ///< the call fails if the random number is below this
    uint32_t seen;
    struct fault_plan_effect effect;
};

/// The caller owns it and must not move it once it is in use. Any thread may call fault_plan_next.
struct fault_plan {
    pthread_mutex_t lock;  ///< guards all members below: several threads share a plan
    struct fault_plan_rule rules[FAULT_PLAN_RULES];
    int count;
    uint64_t random;
    uint32_t injected;  ///< faults so far
};

/// Parses a script ("": no faults). ERROR_SYNTAX or ERROR_RANGE; `message` names the rule and what
/// is wrong with it, including unknown parts and operations; the plan is unchanged then.
int fault_plan_parse(struct fault_plan *self, const char *script, struct message *message);

/// Whether a rule names this part itself, not by "*".
bool fault_plan_names(const struct fault_plan *self, const char *part);

/// The effect on this call. The first rule that is due decides; every rule that matches counts the
/// call. Any thread.
struct fault_plan_effect fault_plan_next(struct fault_plan *self, const char *part,
                                         const char *operation);

#ifdef __cplusplus
}
#endif

#endif
