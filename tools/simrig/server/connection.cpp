// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/connection.hpp"

#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

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
    if (!finished_) {
        inbox_.add(buffer, size_t(count));
    }
    return count > 0;
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
    output_.clear();
    sent_ = 0;
    if (finished_) {
        // Closing now would discard the last reply while the client still sends.
        shutdown(socket_, SHUT_WR);
    }
    return true;
}

void Connection::finish() {
    finished_ = true;
    finished_at_ = std::chrono::steady_clock::now();
}

bool Connection::overdue() const {
    return finished_ && std::chrono::steady_clock::now() - finished_at_ > std::chrono::seconds(1);
}

}  // namespace simrig
