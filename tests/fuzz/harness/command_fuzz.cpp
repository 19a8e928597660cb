// SPDX-License-Identifier: Apache-2.0
// Any line is accepted or refused in one line; accepted values are within the table's ranges, and
// the words written again are the same call.
#include <cstring>
#include <string>
#include <vector>

#include "console/command.h"
#include "core/error.h"
#include "fuzz_check.hpp"

namespace {

struct Call {
    int error;
    const command *found = nullptr;
    command_value values[COMMAND_ARGUMENTS_MAX];
    std::vector<char> storage = std::vector<char>(COMMAND_LINE_MAX + 1);
};

void parse(const std::string &line, Call *call) {
    size_t count = 0;
    const command *table = command_rig_table(&count);
    char message[512];
    std::memset(message, 'x', sizeof message);
    call->error = command_parse(line.c_str(), table, count, call->storage.data(), call->values,
                                &call->found, message, sizeof message);
    FUZZ_CHECK(std::memchr(message, '\0', sizeof message) != nullptr);
    FUZZ_CHECK((call->error == 0) == (message[0] == '\0'));
    for (const char *at = message; *at != '\0'; at++) {
        FUZZ_CHECK(static_cast<unsigned char>(*at) >= ' ' && *at != 0x7F);
    }
    FUZZ_CHECK(call->error == 0 || call->error == ERROR_SYNTAX || call->error == ERROR_RANGE ||
               call->error == ERROR_MISSING || call->error == ERROR_ARGUMENT);
}

std::string quoted(const std::string &word) {
    std::string text = "\"";
    for (const char c : word) {
        text += c == '"' || c == '\\' ? "\\" : "";
        text += c;
    }
    return text + "\"";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string line(reinterpret_cast<const char *>(data), size);
    Call first;
    parse(line, &first);
    if (first.error != 0 || first.found == nullptr) {
        return 0;
    }
    std::string again = first.found->name;
    for (unsigned i = 0; i < first.found->argument_count; i++) {
        const command_argument &argument = first.found->arguments[i];
        const command_value &value = first.values[i];
        const bool option = command_argument_is_option(&argument);
        FUZZ_CHECK(value.given || argument.optional || option);
        if (!value.given) {
            continue;
        }
        if (argument.kind == COMMAND_NUMBER || argument.kind == COMMAND_INTEGER) {
            FUZZ_CHECK(value.number >= argument.min && value.number <= argument.max);
        }
        again += option ? std::string(" ") + argument.name + "=" : " ";
        again += quoted(value.text);
    }
    if (again.size() > COMMAND_LINE_MAX) {
        return 0;
    }
    Call second;
    parse(again, &second);
    FUZZ_CHECK(second.error == 0 && second.found == first.found);
    for (unsigned i = 0; i < first.found->argument_count; i++) {
        FUZZ_CHECK(first.values[i].given == second.values[i].given);
        if (first.values[i].given) {
            FUZZ_CHECK(std::strcmp(first.values[i].text, second.values[i].text) == 0);
            FUZZ_CHECK(first.values[i].number == second.values[i].number);
            FUZZ_CHECK(first.values[i].choice == second.values[i].choice);
        }
    }
    return 0;
}
