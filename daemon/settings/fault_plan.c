// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/fault_plan.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/error.h"
#include "core/invariant.h"

enum { RULE_BYTES = 80, ERROR_NAME_BYTES = 24, OPERATIONS_MAX = 4, WHY_BYTES = 256 };

static const char separators[] = ", \t\n";

/// The parts that fault.h wraps, and their operations.
static const struct part {
    const char *name;
    const char *operations[OPERATIONS_MAX];
} parts[] = {
    {"i2c", {"transfer", "lines"}},
    {"left", {"start", "stop", "take", "control"}},
    {"right", {"start", "stop", "take", "control"}},
    {"gpio", {"set", "get"}},
    {"uart", {"write", "read", "discard"}},
    {"store", {"load", "save", "remove"}},
    {"watchdog", {"feed"}},
};
enum { PARTS = sizeof parts / sizeof parts[0] };

static bool fits(const char *pattern, const char *name) {
    return strcmp(pattern, "*") == 0 || strcmp(pattern, name) == 0;
}

/// Whether any part and operation match the patterns.
static bool is_there(const char *part, const char *operation) {
    for (int i = 0; i < PARTS; i++) {
        for (int k = 0; k < OPERATIONS_MAX && parts[i].operations[k] != NULL; k++) {
            if (fits(part, parts[i].name) && fits(operation, parts[i].operations[k])) {
                return true;
            }
        }
    }
    return false;
}

/// Appends `name` and a comma, unless the list already contains it.
static void list(char why[WHY_BYTES], const char *name) {
    char item[FAULT_PLAN_NAME_BYTES + 4];
    snprintf(item, sizeof item, " %s,", name);
    if (strstr(why, item) == NULL) {
        const size_t used = strlen(why);
        snprintf(why + used, WHY_BYTES - used, "%s", item);
    }
}

/// Checks the names of a rule; NULL, or what is wrong and what exists instead.
static const char *check_names(const struct fault_plan_rule *rule, char why[WHY_BYTES]) {
    if (is_there(rule->part, rule->operation)) {
        return NULL;
    }
    const bool wrong_part = !is_there(rule->part, "*");
    if (wrong_part) {
        snprintf(why, WHY_BYTES, "unknown part \"%s\" (expected", rule->part);
    } else if (strcmp(rule->part, "*") == 0) {
        snprintf(why, WHY_BYTES, "unknown operation \"%s\" (expected", rule->operation);
    } else {
        snprintf(why, WHY_BYTES, "%s: unknown operation \"%s\" (expected", rule->part,
                 rule->operation);
    }
    for (int i = 0; i < PARTS; i++) {
        if (wrong_part) {
            list(why, parts[i].name);
            continue;
        }
        for (int k = 0; k < OPERATIONS_MAX && parts[i].operations[k] != NULL; k++) {
            if (fits(rule->part, parts[i].name)) {
                list(why, parts[i].operations[k]);
            }
        }
    }
    // Replaces the last comma.
    const size_t used = strlen(why) - 1;
    snprintf(why + used, WHY_BYTES - used, " or *)");
    return why;
}

/// The error code for a name in lower case; 0 if unknown.
static int error_named(const char *name) {
    static const struct {
        const char *name;
        int code;
    } errors[] = {
#define ERROR_NAME(name, number, text) {#name, number},
        ERROR_LIST(ERROR_NAME)
#undef ERROR_NAME
    };
    for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
        size_t at = 0;
        while (name[at] != '\0' && tolower((unsigned char)errors[i].name[at]) == name[at]) {
            at++;
        }
        if (name[at] == '\0' && errors[i].name[at] == '\0') {
            return errors[i].code;
        }
    }
    return 0;
}

/// Whether an operation returns bytes, levels or frames.
static bool reads(const char *operation) {
    static const char *const names[] = {"transfer", "take", "read", "get"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strcmp(operation, names[i]) == 0) {
            return true;
        }
    }
    return false;
}

/// Copies the text before one of `ends` and moves past it; false if it is empty or too long.
static bool take_word(const char **at, const char *ends, char word[FAULT_PLAN_NAME_BYTES]) {
    const size_t length = strcspn(*at, ends);
    if (length == 0 || length >= FAULT_PLAN_NAME_BYTES) {
        return false;
    }
    memcpy(word, *at, length);
    word[length] = '\0';
    *at += length;
    return true;
}

static const char *parse_effect(const char *text, struct fault_plan_rule *rule) {
    char name[ERROR_NAME_BYTES];
    const size_t length = strcspn(text, "/");
    if (strcmp(text, "spoil") == 0) {
        rule->effect.corrupt = true;
        return reads(rule->operation) ? NULL : "only transfer, take, read and get can be spoiled";
    }
    if (length >= sizeof name) {
        return "unknown error";
    }
    memcpy(name, text, length);
    name[length] = '\0';
    rule->effect.error = error_named(name);
    if (rule->effect.error == 0) {
        return "unknown error (expected a name of core/error.h in lower case, such as io or "
               "timeout)";
    }
    rule->effect.after = strcmp(text + length, "/after") == 0;
    return text[length] == '\0' || rule->effect.after ? NULL : "only /after may follow an error";
}

/// Parses "@N", "@N+" or "%P".
static const char *parse_turn(const char **at, struct fault_plan_rule *rule) {
    char *end = NULL;
    if (**at == '@') {
        if (!isdigit((unsigned char)(*at)[1])) {
            return "@ requires a number of calls";
        }
        const unsigned long nth = strtoul(*at + 1, &end, 10);
        if (nth < 1 || nth > 1000000000) {
            return "the number of calls must be from 1 to 1000000000";
        }
        rule->first = (uint32_t)nth;
        rule->for_ever = *end == '+';
        *at = end + (rule->for_ever ? 1 : 0);
        return NULL;
    }
    const double probability = strtod(*at + 1, &end);
    if (end == *at + 1 || !(probability >= 0 && probability <= 1)) {
        return "% requires a probability from 0 to 1";
    }
    rule->threshold = (uint32_t)(probability * UINT32_MAX);
    *at = end;
    return NULL;
}

/// Parses a rule; NULL, or what is wrong, possibly in `why`.
static const char *parse_rule(const char *text, struct fault_plan_rule *rule, char why[WHY_BYTES]) {
    *rule = (struct fault_plan_rule){.first = 0};
    if (!take_word(&text, ".@%=", rule->part) || *text++ != '.' ||
        !take_word(&text, "@%=", rule->operation) || *text == '=' || *text == '\0') {
        return "invalid rule (expected PART.OPERATION@N=ERROR, with @N+ or %P instead of @N)";
    }
    const char *wrong = check_names(rule, why);
    wrong = wrong != NULL ? wrong : parse_turn(&text, rule);
    if (wrong != NULL) {
        return wrong;
    }
    return *text != '=' ? "missing =ERROR" : parse_effect(text + 1, rule);
}

static const char *parse_seed(const char *text, uint64_t *seed) {
    char *end = NULL;
    *seed = strtoull(text, &end, 0);
    return isdigit((unsigned char)*text) && *end == '\0' ? NULL : "seed is not an integer";
}

int fault_plan_parse(struct fault_plan *self, const char *script, struct message *message) {
    struct fault_plan plan = {.lock = PTHREAD_MUTEX_INITIALIZER, .random = 1};
    char why[WHY_BYTES];
    for (const char *at = script + strspn(script, separators); *at != '\0';
         at += strspn(at, separators)) {
        const size_t length = strcspn(at, separators);
        char text[RULE_BYTES];
        const char *wrong = "rule too long";
        if (length < sizeof text) {
            memcpy(text, at, length);
            text[length] = '\0';
            if (strncmp(text, "seed=", 5) == 0) {
                wrong = parse_seed(text + 5, &plan.random);
            } else if (plan.count == FAULT_PLAN_RULES) {
                return message_set(message, ERROR_RANGE, "too many rules (at most %d)",
                                   FAULT_PLAN_RULES);
            } else {
                wrong = parse_rule(text, &plan.rules[plan.count++], why);
            }
        }
        if (wrong != NULL) {
            return message_set(message, ERROR_SYNTAX, "fault \"%.*s\": %s",
                               (int)(length < RULE_BYTES ? length : RULE_BYTES), at, wrong);
        }
        at += length;
    }
    *self = plan;
    return ERROR_OK;
}

/// Upper half of SplitMix64 (Steele, Lea, Flood 2014).
static uint32_t draw(uint64_t *state) {
    *state += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = *state;
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return (uint32_t)((z ^ z >> 31) >> 32);
}

bool fault_plan_names(const struct fault_plan *self, const char *part) {
    for (int i = 0; i < self->count; i++) {
        if (strcmp(self->rules[i].part, part) == 0) {
            return true;
        }
    }
    return false;
}

static bool is_due(struct fault_plan *self, struct fault_plan_rule *rule) {
    if (rule->first == 0) {
        return rule->threshold == UINT32_MAX || draw(&self->random) < rule->threshold;
    }
    if (rule->seen < rule->first) {
        rule->seen++;
        return rule->seen == rule->first;
    }
    return rule->for_ever;
}

struct fault_plan_effect fault_plan_next(struct fault_plan *self, const char *part,
                                         const char *operation) {
    INVARIANT(self->count >= 0 && self->count <= FAULT_PLAN_RULES);
    // Otherwise no rule could match it.
    INVARIANT(is_there(part, operation));
    struct fault_plan_effect effect = {.error = 0};
    bool decided = false;
    pthread_mutex_lock(&self->lock);
    for (int i = 0; i < self->count; i++) {
        struct fault_plan_rule *rule = &self->rules[i];
        if (fits(rule->part, part) && fits(rule->operation, operation) && is_due(self, rule) &&
            !decided) {
            effect = rule->effect;
            decided = true;
        }
    }
    self->injected += decided;
    pthread_mutex_unlock(&self->lock);
    return effect;
}
