// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/server.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace simrig {

namespace {

constexpr size_t kMostClients = 32;
constexpr double kSliceUs = 5000;
constexpr int kTickMs = 2;

std::string because(const std::string &what) {
    return what + ": " + std::strerror(errno);
}

}  // namespace

Listener::Listener(const std::string &where) {
    if (where.compare(0, 5, "unix:") == 0) {
        listen_unix(where.substr(5));
    } else if (where.compare(0, 4, "tcp:") == 0) {
        listen_tcp(where.substr(4));
    } else {
        throw std::runtime_error("'" + where + "' is neither unix:PATH nor tcp:PORT");
    }
    if (listen(socket_, 8) != 0) {
        throw std::runtime_error(because("cannot listen on " + where));
    }
}

Listener::~Listener() {
    if (socket_ >= 0) {
        close(socket_);
    }
    if (!path_.empty()) {
        unlink(path_.c_str());
    }
}

// A socket that a program left behind when it was killed is replaced; one that answers is not.
void Listener::listen_unix(const std::string &path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (path.empty() || path.size() >= sizeof address.sun_path) {
        throw std::runtime_error("the path of a socket has 1 to " +
                                 std::to_string(sizeof address.sun_path - 1) +
                                 " characters: " + path);
    }
    std::memcpy(address.sun_path, path.c_str(), path.size());
    socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const auto *generic = reinterpret_cast<const sockaddr *>(&address);
    if (socket_ < 0) {
        throw std::runtime_error(because("cannot make a socket"));
    }
    struct stat found {};
    if (lstat(path.c_str(), &found) == 0) {
        if (!S_ISSOCK(found.st_mode)) {
            throw std::runtime_error(path + " is there already and is not a socket");
        }
        if (connect(socket_, generic, sizeof address) == 0) {
            throw std::runtime_error(path + " is in use by another simrig");
        }
        unlink(path.c_str());
        close(socket_);
        socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    }
    if (bind(socket_, generic, sizeof address) != 0) {
        throw std::runtime_error(because("cannot make the socket " + path));
    }
    path_ = path;
    name_ = "unix:" + path;
}

void Listener::listen_tcp(const std::string &port) {
    size_t used = 0;
    unsigned long number = 65536;
    try {
        number = std::stoul(port, &used);
    } catch (const std::logic_error &) {
        used = 0;
    }
    if (used == 0 || used != port.size() || number > 65535) {
        throw std::runtime_error("'" + port + "' is not a port from 0 to 65535");
    }
    socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(uint16_t(number));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (bind(socket_, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0) {
        throw std::runtime_error(because("cannot use port " + port));
    }
    socklen_t size = sizeof address;
    getsockname(socket_, reinterpret_cast<sockaddr *>(&address), &size);
    name_ = "tcp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
}

Server::Server(Listener &listener, Board &board, std::function<void()> tick,
               std::vector<LogEntry> *log)
    : listener_(listener), board_(board), tick_(std::move(tick)), log_(log) {}

void Server::run(int stop_pipe) {
    for (;;) {
        std::vector<pollfd> polled = {{stop_pipe, POLLIN, 0}, {listener_.socket(), POLLIN, 0}};
        for (const auto &client : clients_) {
            const Connection &connection = client->connection;
            const bool reads = !client->waits && !connection.clogged();
            polled.push_back({connection.socket(),
                              short((reads ? POLLIN : 0) | (connection.has_output() ? POLLOUT : 0)),
                              0});
        }
        const int timeout_ms = board_.busy() ? 0 : tick_ ? kTickMs : -1;
        if (poll(polled.data(), polled.size(), timeout_ms) < 0 && errno != EINTR) {
            throw std::runtime_error(because("cannot wait for clients"));
        }
        if (polled[0].revents != 0) {
            return;
        }
        // Clients that go are taken out from the back, so that the numbers in front stay right.
        for (size_t i = clients_.size(); i-- > 0;) {
            Client &client = *clients_[i];
            const short seen = polled[i + 2].revents;
            const bool gone = (seen & (POLLERR | POLLHUP)) != 0 && (seen & POLLIN) == 0;
            const bool alive = !gone && (seen & POLLIN ? client.connection.receive() : true) &&
                               serve(client) && client.connection.flush();
            if (!alive) {
                drop(i);
            }
        }
        if (polled[1].revents != 0) {
            accept_client();
        }
        step();
        if (tick_) {
            tick_();
        }
    }
}

void Server::accept_client() {
    const int socket = accept4(listener_.socket(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) {
        return;
    }
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    auto client = std::make_unique<Client>(socket);
    if (clients_.size() >= kMostClients) {
        client->connection.send({SIMRIG_HELLO | SIMRIG_REPLY, 0,
                                 refusal(SIMRIG_BUSY, "this simrig has 32 clients already")});
        client->connection.flush();
        return;
    }
    clients_.push_back(std::move(client));
}

// The messages of one client, in order; a request that lets time pass holds up those behind it.
bool Server::serve(Client &client) {
    while (!client.waits && !client.connection.clogged()) {
        const std::optional<Message> message = client.connection.next();
        if (!message) {
            return true;
        }
        handle(client, *message);
    }
    return true;
}

void Server::answer(Client &client, uint16_t type, uint16_t tag, Body body) {
    client.connection.send({uint16_t(type | SIMRIG_REPLY), tag, std::move(body)});
}

void Server::handle(Client &client, const Message &message) {
    std::optional<simrig_role> &role = client.connection.role;
    if (message.type == SIMRIG_HELLO) {
        bool taken = false;
        for (const auto &other : clients_) {
            taken =
                taken || (other.get() != &client && other->connection.role == SIMRIG_ROLE_BOARD);
        }
        answer(client, message.type, message.tag, board_.greet(message.body, taken, role));
        return;
    }
    if (!role) {
        answer(client, message.type, message.tag,
               refusal(SIMRIG_BAD_VERSION, "the first request must be a greeting"));
        return;
    }
    const bool waits_for_other = board_.busy();
    if (waits_for_other && (message.type == SIMRIG_ADVANCE || message.type == SIMRIG_FRAME_WAIT)) {
        answer(client, message.type, message.tag,
               refusal(SIMRIG_BUSY, "another client is letting time pass"));
        return;
    }
    std::optional<Body> reply = board_.begin(message.type, message.body, *role);
    if (reply) {
        record(client, message.type, message.body, *reply);
        answer(client, message.type, message.tag, std::move(*reply));
        return;
    }
    client.waits = true;
    client.asked = message.body;
    client.type = message.type;
    client.tag = message.tag;
}

void Server::step() {
    if (!board_.busy()) {
        return;
    }
    std::optional<Body> reply = board_.step(kSliceUs);
    if (!reply) {
        return;
    }
    for (const auto &client : clients_) {
        if (client->waits) {
            client->waits = false;
            record(*client, client->type, client->asked, *reply);
            answer(*client, client->type, client->tag, std::move(*reply));
            serve(*client);
            client->connection.flush();
            return;
        }
    }
}

void Server::record(const Client &client, uint16_t type, const Body &asked, const Body &reply) {
    if (log_ != nullptr) {
        log_->push_back({type, uint16_t(*client.connection.role), sum_of(reply), asked});
    }
}

void Server::drop(size_t number) {
    const Client &client = *clients_[number];
    if (client.waits) {
        board_.abandon();
    }
    if (client.connection.role == SIMRIG_ROLE_BOARD) {
        board_.release();
        if (log_ != nullptr) {
            log_->push_back({});
        }
    }
    clients_.erase(clients_.begin() + long(number));
}

}  // namespace simrig
