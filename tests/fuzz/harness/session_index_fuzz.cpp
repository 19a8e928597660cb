// SPDX-License-Identifier: Apache-2.0
// A session's index, unchanged and with the CRC of each line corrected: events come in order,
// each prints as its line, and a line that is not whole ends the session or is refused.
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <string>

#include "core/crc.h"
#include "core/error.h"
#include "daemon/session/session_read.h"
#include "fuzz_check.hpp"

namespace {

// Each line of the input with the CRC that makes it count.
std::string framed(const std::string &text) {
    std::string all;
    std::uint32_t crc = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string line = text.substr(at, end - at);
        char word[1 + SESSION_CRC_DIGITS + 1];
        std::snprintf(word, sizeof word, " %08x",
                      unsigned(crc_update(crc, line.data(), line.size())));
        line += std::string(word) + "\n";
        crc = crc_update(crc, line.data(), line.size());
        all += line;
        at = end + 1;
    }
    return all;
}

// The reader of an index that is in memory already.
void check(std::string text) {
    static session_reader reader;
    static session_event event;
    static message message_out;
    std::memset(&reader, 0, offsetof(session_reader, directory));
    reader.path[0] = 'x';
    reader.directory = -1;
    reader.text = text.data();
    reader.length = text.size();
    reader.at = 0;
    reader.crc = 0;
    reader.line = 0;
    reader.ended = reader.cut = false;
    int count = 0, got;
    for (std::size_t at = 0; (got = session_reader_next(&reader, &event, &message_out)) == 1;
         at = reader.at) {
        count++;
        FUZZ_CHECK(reader.line == count && reader.at > at && reader.at <= text.size());
        FUZZ_CHECK((event.kind == SESSION_BEGIN) == (count == 1));
        char line[SESSION_LINE_MAX + 1];
        const int length = session_event_print(&event, line);
        FUZZ_CHECK(length > 0 && text.compare(at, std::size_t(length), line) == 0);
        FUZZ_CHECK(reader.at - at == std::size_t(length) + 1 + SESSION_CRC_DIGITS + 1);
    }
    FUZZ_CHECK(got == 0 || got == ERROR_CRC || got == ERROR_SYNTAX);
    FUZZ_CHECK(got != 0 || reader.at == text.size());
    FUZZ_CHECK(got != 0 || reader.cut || event.kind == SESSION_END);
    FUZZ_CHECK(got == 0 ||
               (message_out.text[0] != '\0' && std::strchr(message_out.text, '\n') == nullptr));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string text(reinterpret_cast<const char *>(data), size);
    check(text);
    check(framed(text));
    return 0;
}
