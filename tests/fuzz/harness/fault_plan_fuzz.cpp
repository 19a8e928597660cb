// SPDX-License-Identifier: Apache-2.0
// A script of faults is accepted or refused in one line. Accepted scripts can be executed: their
// errors are of the list, and a rule for the nth call waits for the nth.
#include <cstring>
#include <string>

#include "core/error.h"
#include "daemon/settings/fault_plan.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string script(reinterpret_cast<const char *>(data), size);
    fault_plan plan;
    std::memset(&plan, 0x55, sizeof plan);
    const fault_plan untouched = plan;
    message text;
    const int error = fault_plan_parse(&plan, script.c_str(), &text);
    if (error != ERROR_OK) {
        FUZZ_CHECK(error == ERROR_SYNTAX || error == ERROR_RANGE);
        FUZZ_CHECK(std::strlen(text.text) > 0 && std::strchr(text.text, '\n') == nullptr);
        FUZZ_CHECK(std::memcmp(&plan, &untouched, sizeof plan) == 0);
        return 0;
    }
    FUZZ_CHECK(plan.count >= 0 && plan.count <= FAULT_PLAN_RULES && plan.injected == 0);
    for (int i = 0; i < plan.count; i++) {
        const fault_plan_rule &rule = plan.rules[i];
        FUZZ_CHECK(std::strlen(rule.part) < FAULT_PLAN_NAME_BYTES && rule.part[0] != '\0');
        FUZZ_CHECK(std::strlen(rule.operation) < FAULT_PLAN_NAME_BYTES);
        FUZZ_CHECK((rule.effect.error != 0) != rule.effect.corrupt);
        FUZZ_CHECK(rule.effect.error == 0 ||
                   std::strcmp(error_text(rule.effect.error), "unknown error") != 0);
        FUZZ_CHECK(rule.first == 0 || rule.threshold == 0);
    }
    for (uint32_t call = 1; call <= 3; call++) {
        const fault_plan_effect effect = fault_plan_next(&plan, "i2c", "transfer");
        FUZZ_CHECK(plan.injected <= call);
        FUZZ_CHECK(!effect.after || effect.error != 0);
    }
    return 0;
}
