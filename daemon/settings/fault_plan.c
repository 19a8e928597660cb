// SPDX-License-Identifier: Apache-2.0
#include "daemon/settings/fault_plan.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "console/command_words.h"
#include "core/error.h"
#include "core/invariant.h"

enum { RULE_BYTES = 80, OPERATION_NAMES = 32, CALLS_MAX = 1000000000 };

static const char separators[] = ", \t\n";

/// The parts that fault.h wraps, and their operations.
static const struct {
    const char *name, *operations;
} parts[] = {
    {"i2c", "transfer lines"},
    {"left", "start stop take control"},
    {"right", "start stop take control"},
    {"gpio", "set get"},
    {"uart", "write read discard"},
    {"store", "load save remove"},
    {"watchdog", "feed"},
};
enum { PARTS = sizeof parts / sizeof parts[0] };

static bool fits(const char *pattern, const char *name) {
    return strcmp(pattern, "*") == 0 || strcmp(pattern, name) == 0;
}

/// Whether any part and operation match the patterns.
static bool is_there(const char *part, const char *operation) {
    for (int i = 0; i < PARTS; i++) {
        if (fits(part, parts[i].name) &&
            (strcmp(operation, "*") == 0 ||
             command_words_choice(operation, parts[i].operations) >= 0)) {
            return true;
        }
    }
    return false;
}

/// Rejects a rule whose names match nothing, with the names that exist.
static int reject_names(const struct fault_plan_rule *rule, struct message *why) {
    char names[PARTS * OPERATION_NAMES] = "";
    const bool wrong_part = !is_there(rule->part, "*");
    for (int i = 0; i < PARTS; i++) {
        const char *name = wrong_part ? parts[i].name : parts[i].operations;
        const size_t used = strlen(names);
        if (wrong_part || fits(rule->part, parts[i].name)) {
            snprintf(names + used, sizeof names - used, "%s ", name);
        }
    }
    return message_set(why, ERROR_SYNTAX, "unknown %s \"%s\" (expected one of: %s*)",
                       wrong_part ? "part" : "operation", wrong_part ? rule->part : rule->operation,
                       names);
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
        if (strcasecmp(errors[i].name, name) == 0) {
            return errors[i].code;
        }
    }
    return 0;
}

/// Parses "ERROR", "ERROR/after" or "spoil".
static int parse_effect(char *text, struct fault_plan_rule *rule, struct message *why) {
    static const char reading[] = "transfer take read get";  // bytes, levels or frames
    if (strcmp(text, "spoil") == 0) {
        rule->effect.corrupt = true;
        return command_words_choice(rule->operation, reading) >= 0
                   ? 0
                   : message_set(why, ERROR_SYNTAX, "spoil requires one of: %s", reading);
    }
    char *after = strchr(text, '/');
    rule->effect.after = after != NULL;
    if (after != NULL && strcmp(after, "/after") != 0) {
        return message_set(why, ERROR_SYNTAX, "only /after may follow an error");
    }
    text[strcspn(text, "/")] = '\0';
    rule->effect.error = error_named(text);
    return rule->effect.error != ERROR_OK
               ? 0
               : message_set(why, ERROR_SYNTAX,
                             "unknown error \"%s\" (expected a name of core/error.h in lower case, "
                             "such as io or timeout)",
                             text);
}

/// Parses "@N", "@N+" or "%P", up to the "=".
static int parse_turn(const char *text, struct fault_plan_rule *rule, struct message *why) {
    char *end = NULL;
    if (*text == '@') {
        const unsigned long nth = strtoul(text + 1, &end, 10);
        rule->first = (uint32_t)nth;
        rule->for_ever = *end == '+';
        end += rule->for_ever;
        return isdigit((unsigned char)text[1]) && *end == '\0' && nth >= 1 && nth <= CALLS_MAX
                   ? 0
                   : message_set(why, ERROR_SYNTAX, "@ requires a call from 1 to %d, or %d+",
                                 CALLS_MAX, CALLS_MAX);
    }
    const double probability = strtod(text + 1, &end);
    if (end == text + 1 || *end != '\0' || !(probability >= 0 && probability <= 1)) {
        return message_set(why, ERROR_SYNTAX, "%% requires a probability from 0 to 1");
    }
    rule->threshold = (uint32_t)(probability * UINT32_MAX);
    return ERROR_OK;
}

static int parse_rule(char *text, struct fault_plan_rule *rule, struct message *why) {
    int names = 0;
    char *effect = strchr(text, '=');
    *rule = (struct fault_plan_rule){.first = 0};
    if (effect == NULL ||
        sscanf(text, "%15[^.@%=].%15[^@%=]%n", rule->part, rule->operation, &names) != 2 ||
        strchr("@%", text[names]) == NULL) {
        return message_set(why, ERROR_SYNTAX,
                           "invalid rule (expected PART.OPERATION@N=ERROR, with @N+ or %%P instead "
                           "of @N)");
    }
    *effect = '\0';
    if (!is_there(rule->part, rule->operation)) {
        return reject_names(rule, why);
    }
    const int error = parse_turn(text + names, rule, why);
    return error != ERROR_OK ? error : parse_effect(effect + 1, rule, why);
}

static int parse_seed(const char *text, uint64_t *seed, struct message *why) {
    char *end = NULL;
    *seed = strtoull(text, &end, 0);
    return isdigit((unsigned char)*text) && *end == '\0'
               ? 0
               : message_set(why, ERROR_SYNTAX, "seed is not an integer");
}

int fault_plan_parse(struct fault_plan *self, const char *script, struct message *message) {
    struct fault_plan plan = {.lock = PTHREAD_MUTEX_INITIALIZER, .random = 1};
    for (const char *at = script + strspn(script, separators); *at != '\0';
         at += strspn(at, separators)) {
        const int length = (int)strcspn(at, separators);
        char text[RULE_BYTES];
        struct message why = {.text = "rule too long"};
        int error = ERROR_SYNTAX;
        if (snprintf(text, sizeof text, "%.*s", length, at) < (int)sizeof text) {
            if (strncmp(text, "seed=", 5) == 0) {
                error = parse_seed(text + 5, &plan.random, &why);
            } else if (plan.count == FAULT_PLAN_RULES) {
                return message_set(message, ERROR_RANGE, "too many rules (at most %d)",
                                   FAULT_PLAN_RULES);
            } else {
                error = parse_rule(text, &plan.rules[plan.count++], &why);
            }
        }
        if (error != ERROR_OK) {
            return message_set(message, error, "fault \"%.*s\": %.500s", length, at, why.text);
        }
        at += length;
    }
    INVARIANT(plan.count >= 0 && plan.count <= FAULT_PLAN_RULES && plan.injected == 0);
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
    INVARIANT(rule->first == 0 || (rule->threshold == 0 && rule->seen <= rule->first));
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
