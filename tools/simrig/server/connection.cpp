// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/connection.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "tools/simrig/server/body.hpp"

namespace simrig {

Connection::~Connection() {
    close(socket_);
}

bool Connection::receive() {
    uint8_t buffer[65536];
    const ssize_t count = recv(socket_, buffer, sizeof buffer, 0);
    if (count < 0) {
        return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    }
    input_.insert(input_.end(), buffer, buffer + count);
    if (input_.size() >= SIMRIG_HEADER_BYTES) {
        BodyReader header(input_.data(), SIMRIG_HEADER_BYTES);
        return count > 0 && header.u32() <= SIMRIG_BODY_MAX;
    }
    return count > 0;
}

std::optional<Message> Connection::next() {
    if (input_.size() < SIMRIG_HEADER_BYTES) {
        return std::nullopt;
    }
    BodyReader header(input_.data(), SIMRIG_HEADER_BYTES);
    const size_t length = header.u32();
    if (input_.size() < SIMRIG_HEADER_BYTES + length) {
        return std::nullopt;
    }
    Message message;
    message.type = header.u16();
    message.tag = header.u16();
    const auto begin = input_.begin() + SIMRIG_HEADER_BYTES;
    message.body.assign(begin, begin + long(length));
    input_.erase(input_.begin(), begin + long(length));
    return message;
}

void Connection::send(const Message &message) {
    BodyWriter writer;
    writer.u32(uint32_t(message.body.size()));
    writer.u16(message.type);
    writer.u16(message.tag);
    writer.bytes(message.body);
    const std::vector<uint8_t> bytes = writer.take();
    if (sent_ == output_.size()) {
        output_.clear();
        sent_ = 0;
    }
    output_.insert(output_.end(), bytes.begin(), bytes.end());
}

bool Connection::flush() {
    while (has_output()) {
        const ssize_t count =
            ::send(socket_, output_.data() + sent_, output_.size() - sent_, MSG_NOSIGNAL);
        if (count < 0) {
            return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
        }
        sent_ += size_t(count);
    }
    return true;
}

}  // namespace simrig
