// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/wire/message.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "tools/simrig/wire/body.hpp"

namespace simrig {

void Inbox::add(const uint8_t *bytes, size_t count) {
    bytes_.erase(bytes_.begin(), bytes_.begin() + long(at_));
    at_ = 0;
    bytes_.insert(bytes_.end(), bytes, bytes + count);
}

size_t Inbox::announced() const {
    return BodyReader(bytes_.data() + at_, SIMRIG_HEADER_BYTES).u32();
}

std::optional<Message> Inbox::too_long() const {
    if (waiting() < SIMRIG_HEADER_BYTES || announced() <= SIMRIG_BODY_MAX) {
        return std::nullopt;
    }
    BodyReader header(bytes_.data() + at_, SIMRIG_HEADER_BYTES);
    header.u32();
    Message message;
    message.type = header.u16();
    message.tag = header.u16();
    return message;
}

std::optional<Message> Inbox::next() {
    if (waiting() < SIMRIG_HEADER_BYTES || announced() > SIMRIG_BODY_MAX ||
        waiting() - SIMRIG_HEADER_BYTES < announced()) {
        return std::nullopt;
    }
    BodyReader reader(bytes_.data() + at_, waiting());
    const size_t length = reader.u32();
    Message message;
    message.type = reader.u16();
    message.tag = reader.u16();
    message.body = reader.bytes(length);
    at_ += SIMRIG_HEADER_BYTES + length;
    return message;
}

void append(Body &output, const Message &message) {
    BodyWriter writer;
    writer.u32(uint32_t(message.body.size()));
    writer.u16(message.type);
    writer.u16(message.tag);
    const Body header = writer.take();
    output.insert(output.end(), header.begin(), header.end());
    output.insert(output.end(), message.body.begin(), message.body.end());
}

namespace {

struct OpenFile {
    int number;
    explicit OpenFile(const std::string &path)
        : number(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
    ~OpenFile() {
        if (number >= 0) {
            close(number);
        }
    }
    OpenFile(const OpenFile &) = delete;
    OpenFile &operator=(const OpenFile &) = delete;
};

}  // namespace

Body whole_file(const std::string &path, size_t max) {
    const OpenFile file(path);
    struct stat found {};
    if (file.number < 0 || fstat(file.number, &found) != 0) {
        throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
    }
    if (!S_ISREG(found.st_mode)) {
        throw std::runtime_error(path + ": not a file");
    }
    Body bytes;
    uint8_t buffer[65536];
    for (;;) {
        const ssize_t count = read(file.number, buffer, sizeof buffer);
        if (count < 0) {
            throw std::runtime_error(path + ": cannot be read: " + std::strerror(errno));
        }
        if (count == 0) {
            return bytes;
        }
        bytes.insert(bytes.end(), buffer, buffer + count);
        if (bytes.size() > max) {
            throw std::runtime_error(path + ": too long");
        }
    }
}

}  // namespace simrig
