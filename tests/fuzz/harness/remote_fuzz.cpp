// SPDX-License-Identifier: Apache-2.0
// Arbitrary bytes from the daemon to the client: its calls end with an answer or a one-line error,
// and a fetched file is the announced one.
//
// The first byte selects request and transport. Of the following lines those that begin with ~
// become the content of a framed answer, those with = the bytes of a block as the daemon sends it;
// others are sent unchanged.
#include <cjson/cJSON.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "core/base64.h"
#include "core/crc.h"
#include "core/error.h"
#include "daemon/client/remote.h"
#include "fuzz_check.hpp"
#include "memory_folder.hpp"

namespace {

enum { kSerial = 1, kJson = 2, kFetch = 4, kAsk = 8 };

std::string hex(const std::string &text) {
    char digits[9];
    std::snprintf(digits, sizeof digits, "%08X", unsigned(crc_update(0, text.data(), text.size())));
    return digits;
}

// An answer with the number of the request that it answers.
std::string framed(int id, const std::string &inside) {
    const std::string line = "{\"id\": " + std::to_string(id) + ", \"result\": {" + inside +
                             "}, \"ok\": true, \"error\": \"OK\", \"message\": \"\"";
    return line + ", \"crc\": \"" + hex(line) + "\"}\n";
}

// All received bytes, and the content of the blocks among them.
std::string answers(const std::string &text, bool fetch, std::string *content) {
    std::string lines;
    int id = fetch ? 1 : 0;  // the announcement goes first
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        const std::string rest = line.substr(std::min<std::size_t>(line.size(), 1));
        if (line[0] == '~') {
            lines += framed(++id, rest);
        } else if (line[0] == '=') {
            std::string base64(rest.size() / 3 * 4 + 8, '\0');
            base64_encode(rest.data(), rest.size(), base64.data());
            lines +=
                framed(++id, "\"offset\": " + std::to_string(content->size()) + ", \"crc\": \"" +
                                 hex(rest) + "\", \"data\": \"" + base64.c_str() + "\"");
            *content += rest;
        } else {
            lines += line + "\n";
        }
        at = end + 1;
    }
    if (!fetch) {
        return lines;
    }
    return framed(1, "\"size\": " + std::to_string(content->size()) + ", \"crc\": \"" +
                         hex(*content) + "\"") +
           lines;
}

void nothing(remote *, void *, const char *) {}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    static const MemoryFolder folder;
    static const std::string local = folder.path() + "/f";
    static char buffer[REMOTE_LINE_BYTES];
    if (size == 0) {
        return 0;
    }
    std::string content;
    const bool fetch = (data[0] & kFetch) != 0;
    const std::string come =
        answers(std::string(reinterpret_cast<const char *>(data) + 1, size - 1), fetch, &content);
    int ends[2];
    FUZZ_CHECK(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) == 0);
    const bool sent = write(ends[1], come.data(), come.size()) == ssize_t(come.size());
    shutdown(ends[1], SHUT_WR);
    remote self{};
    self.line.fd = ends[0];
    self.line.serial = (data[0] & kSerial) != 0;
    self.line.data = buffer;
    self.json = (data[0] & kJson) != 0;
    self.extra_fd = -1;
    message message_out;
    message_out.text[0] = '\0';
    int error = 0;
    if (!sent) {
        error = 1;  // more than fits between the two
    } else if (fetch) {
        static remote_written written;
        error = remote_fetch(&self, "f", local.c_str(), &written, &message_out);
    } else if ((data[0] & kAsk) != 0) {
        error = remote_ask(&self, "status", nothing, nullptr, &message_out);
    } else {
        const cJSON *result = nullptr;
        error = remote_call(&self, "status", &result, &message_out);
        FUZZ_CHECK(error != 0 || self.answer != nullptr);
    }
    cJSON_Delete(self.answer);
    close(ends[0]);
    close(ends[1]);
    FUZZ_CHECK(error >= 0 ||
               (message_out.text[0] != '\0' && std::strchr(message_out.text, '\n') == nullptr));
    if (fetch && sent && error == 0) {
        std::ifstream file(local, std::ios::binary);
        FUZZ_CHECK(std::string(std::istreambuf_iterator<char>(file), {}) == content);
    }
    unlink(local.c_str());
    unlink((local + ".part").c_str());
    return 0;
}
