// SPDX-License-Identifier: Apache-2.0
/// Which calls of which part are to fail, from a script of one line:
///
///     i2c.transfer@5=i2c_nack          the fifth transfer fails
///     left.take@3+=timeout             the third frame and all later ones
///     store.*%0.01=io                  every call, each with a probability of 1 %
///     uart.write@2=timeout/after       it is done, and fails all the same
///     uart.read@4=spoil                it succeeds with wrong bytes (frames: damaged)
///     seed=7                           of the probabilities, else 1
///
/// Rules are separated by commas or spaces. Parts and their operations are those that fault.h
/// wraps; a camera behind which both sensors are is "left". "*" is every part, or every operation
/// of one. Errors are those of core/error.h in lower case.
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

/// What happens to a call.
struct fault_plan_effect {
    int error;   ///< 0: none
    bool after;  ///< the call is made, and then `error` is returned
    bool spoil;  ///< the call is made, and what it read is wrong
};

struct fault_plan_rule {
    char part[FAULT_PLAN_NAME_BYTES], operation[FAULT_PLAN_NAME_BYTES];
    uint32_t first;      ///< from 1; 0: by probability
    bool for_ever;       ///< and all after the first
    uint32_t threshold;  ///< a draw below it: the call fails
    uint32_t seen;
    struct fault_plan_effect effect;
};

/// The caller owns it; once it is in use it must not move. Any thread may ask whose turn it is.
struct fault_plan {
    pthread_mutex_t lock;  ///< of all below: parts that share a plan belong to several threads
    struct fault_plan_rule rules[FAULT_PLAN_RULES];
    int count;
    uint64_t random;
    uint32_t injected;  ///< faults so far
};

/// Reads a script ("": nothing ever fails). ERROR_SYNTAX, ERROR_RANGE; `message` names the rule and
/// says what is wrong, also that there is no such part or operation; the plan is untouched then.
int fault_plan_parse(struct fault_plan *self, const char *script, struct message *message);

/// Whether a rule is of this part by name, so not as one of all.
bool fault_plan_names(const struct fault_plan *self, const char *part);

/// What is to happen to this call; the first rule whose turn it is decides, and all that fit count.
/// Any thread.
struct fault_plan_effect fault_plan_next(struct fault_plan *self, const char *part,
                                         const char *operation);

#ifdef __cplusplus
}
#endif

#endif
