// SPDX-License-Identifier: Apache-2.0
// The prefix of a command is accepted or refused with a message; a wrong CRC is never accepted, and
// the command is always the end of the line.
#include <cstring>
#include <string>

#include "console/line/request.h"
#include "core/crc.h"
#include "core/error.h"
#include "fuzz_check.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string line(reinterpret_cast<const char *>(data), size);
    const char *text = line.c_str();
    char message[160];
    request taken{};
    std::memset(message, 'x', sizeof message);
    const int error = request_parse(text, &taken, message, sizeof message);
    FUZZ_CHECK(error == 0 || error == ERROR_SYNTAX || error == ERROR_CRC);
    FUZZ_CHECK(std::memchr(message, '\0', sizeof message) != nullptr);
    FUZZ_CHECK((error == 0) == (message[0] == '\0'));
    FUZZ_CHECK(taken.command >= text && taken.command <= text + std::strlen(text));
    if (error == 0 && taken.framed) {
        char crc[16];
        std::string prefix(text, taken.command);
        const std::string rest = prefix.substr(0, prefix.rfind("crc=")) + taken.command;
        std::snprintf(crc, sizeof crc, "%08X", unsigned(crc_update(0, rest.data(), rest.size())));
        for (char &c : prefix) {
            c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
        FUZZ_CHECK(prefix.find(std::string("CRC=") + crc) != std::string::npos);
    }
    return 0;
}
