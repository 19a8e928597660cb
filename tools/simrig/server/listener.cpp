// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace simrig {

namespace {

constexpr int kWaiting = 64;  // length of the accept queue

// Appended to a socket's name until it listens.
const std::string kBeside = ".new";

const std::string kUnix = "unix:", kTcp = "tcp:";
const size_t kLongestPath = sizeof sockaddr_un::sun_path - 1 - kBeside.size();
constexpr size_t kPortDigits = 5;

std::string because(const std::string &what) {
    return what + ": " + std::strerror(errno);
}

// An existing file that is not a socket is kept.
bool is_socket(const std::string &path) {
    struct stat found {};
    if (lstat(path.c_str(), &found) != 0) {
        return false;
    }
    if (!S_ISSOCK(found.st_mode)) {
        throw std::runtime_error(path + " exists and is not a socket");
    }
    return true;
}

}  // namespace

std::string Listener::wrong_place(const std::string &where) {
    if (where.compare(0, kUnix.size(), kUnix) == 0) {
        const size_t bytes = where.size() - kUnix.size();
        if (bytes == 0 || bytes > kLongestPath) {
            return "the path of a socket must have 1 to " + std::to_string(kLongestPath) +
                   " characters: " + where.substr(kUnix.size());
        }
        return "";
    }
    if (where.compare(0, kTcp.size(), kTcp) != 0) {
        return "'" + where + "' is neither unix:PATH nor tcp:PORT";
    }
    const std::string port = where.substr(kTcp.size());
    const bool digits = !port.empty() && port.size() <= kPortDigits &&
                        port.find_first_not_of("0123456789") == std::string::npos;
    return digits && std::stoul(port) <= UINT16_MAX
               ? ""
               : "'" + port + "' is not a port from 0 to 65535";
}

Listener::Listener(const std::string &where) {
    const std::string wrong = wrong_place(where);
    if (!wrong.empty()) {
        throw std::runtime_error(wrong);
    }
    if (where.compare(0, kUnix.size(), kUnix) == 0) {
        listen_unix(where.substr(kUnix.size()));
    } else {
        listen_tcp(uint16_t(std::stoul(where.substr(kTcp.size()))));
    }
}

Listener::~Listener() {
    if (socket_ >= 0) {
        close(socket_);
    }
    if (!path_.empty() && is_socket(path_)) {
        unlink(path_.c_str());
    }
}

// The socket of a killed program is replaced; one that accepts connections is not.
void Listener::listen_unix(const std::string &path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.size());
    socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const auto *generic = reinterpret_cast<const sockaddr *>(&address);
    if (socket_ < 0) {
        throw std::runtime_error(because("cannot create a socket"));
    }
    if (is_socket(path)) {
        if (connect(socket_, generic, sizeof address) == 0) {
            throw std::runtime_error(path + " is in use by another simrig");
        }
        close(socket_);
        socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    }
    // The name appears only once the socket accepts connections.
    const std::string beside = path + kBeside;
    std::memcpy(address.sun_path, beside.c_str(), beside.size());
    if (is_socket(beside)) {
        unlink(beside.c_str());
    }
    // A client can make simrig read and write files: only its user may connect.
    const mode_t others = umask(S_IRWXG | S_IRWXO);
    const bool made = bind(socket_, generic, sizeof address) == 0 &&
                      listen(socket_, kWaiting) == 0 && rename(beside.c_str(), path.c_str()) == 0;
    const int reason = errno;
    umask(others);
    if (!made) {
        unlink(beside.c_str());
        errno = reason;
        throw std::runtime_error(because("cannot create the socket " + path));
    }
    path_ = path;
    name_ = "unix:" + path;
}

void Listener::listen_tcp(uint16_t port) {
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(socket_, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0 ||
        listen(socket_, kWaiting) != 0) {
        throw std::runtime_error(because("cannot use port " + std::to_string(port)));
    }
    socklen_t size = sizeof address;
    getsockname(socket_, reinterpret_cast<sockaddr *>(&address), &size);
    name_ = "tcp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

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
