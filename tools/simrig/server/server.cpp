// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/server.hpp"

#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "tools/simrig/wire/body.hpp"

namespace simrig {

namespace {

constexpr size_t kMaxClients = 32;
constexpr int kTickMs = 2, kDrainMs = 100;

}  // namespace

Server::Server(Listener &listener, Session &session, std::string rig_name,
               std::function<void()> tick)
    : listener_(listener),
      session_(session),
      rig_name_(std::move(rig_name)),
      tick_(std::move(tick)) {}

void Server::run(int stop_pipe) {
    for (;;) {
        wait_for_events(stop_pipe);
        if (stop_) {
            return;
        }
        if (connection_pending_) {
            accept_client();
        }
        if (session_.board().busy()) {
            step();
        } else if (session_.board().has_wall_time()) {
            behind_ = session_.board().keep_up();
        }
        if (tick_) {
            tick_();
        }
    }
}

int Server::timeout_ms() const {
    if (session_.board().has_wall_time()) {
        return behind_ ? 0 : kTickMs;
    }
    if (session_.board().busy()) {
        return 0;
    }
    const bool drain = std::any_of(clients_.begin(), clients_.end(), [](const auto &client) {
        return client->connection.finished();
    });
    return drain ? kDrainMs : -1;
}

void Server::wait_for_events(int stop_pipe) {
    std::vector<pollfd> polled = {{stop_pipe, POLLIN, 0}, {listener_.socket(), POLLIN, 0}};
    for (const auto &client : clients_) {
        const Connection &connection = client->connection;
        const bool reads = !client->waits && !client->silent && !connection.output_full();
        const int wanted = (reads ? POLLIN : 0) | (client->waits ? POLLRDHUP : 0) |
                           (connection.has_output() ? POLLOUT : 0);
        polled.push_back({connection.socket(), short(wanted), 0});
    }
    if (poll(polled.data(), polled.size(), timeout_ms()) < 0 && errno != EINTR) {
        throw std::runtime_error(std::string("cannot wait for clients: ") + std::strerror(errno));
    }
    stop_ = polled[0].revents != 0;
    connection_pending_ = polled[1].revents != 0;
    // Clients are removed from the back, so that indices in front stay valid.
    for (size_t i = clients_.size(); i-- > 0;) {
        if (!service(*clients_[i], polled[i + 2].revents)) {
            drop(i);
        }
    }
}

// False: the client disconnected.
bool Server::service(Client &client, short seen) {
    Connection &connection = client.connection;
    const bool may_be_received = (seen & POLLIN) != 0;
    if ((seen & POLLERR) != 0 || (client.waits && (seen & (POLLRDHUP | POLLHUP)) != 0) ||
        ((seen & POLLHUP) != 0 && !may_be_received) || connection.overdue()) {
        return false;
    }
    if (may_be_received && !connection.receive()) {
        client.silent = true;
    }
    serve(client);
    // A client that sends no more is closed once all its requests are answered.
    return connection.flush() && (!client.silent || client.waits || connection.has_output());
}

void Server::accept_client() {
    const int socket = accept4(listener_.socket(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) {
        return;
    }
    const int on = 1;
    setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    auto client = std::make_unique<Client>(socket);
    if (clients_.size() >= kMaxClients) {
        // The oldest connection that has not greeted makes room.
        const auto silent = std::find_if(clients_.begin(), clients_.end(),
                                         [](const auto &other) { return !other->connection.role; });
        if (silent != clients_.end()) {
            drop(size_t(silent - clients_.begin()));
        }
    }
    if (clients_.size() >= kMaxClients) {
        client->connection.send({SIMRIG_HELLO | SIMRIG_REPLY, 0,
                                 rejection({SIMRIG_BUSY, "too many clients (at most 32)"})});
        client->connection.flush();
        return;
    }
    clients_.push_back(std::move(client));
}

// The messages of one client, in order; a request that advances time delays those behind it.
void Server::serve(Client &client) {
    Connection &connection = client.connection;
    while (!client.waits && !connection.output_full() && !connection.finished()) {
        std::optional<Message> message = connection.next();
        if (message) {
            handle(client, *message);
            continue;
        }
        message = connection.too_long();
        if (!message) {
            return;
        }
        connection.send({uint16_t(message->type | SIMRIG_REPLY), message->tag,
                         rejection({SIMRIG_BAD_REQUEST, "a message has at most 16777216 bytes"})});
        connection.finish();
    }
}

Body Server::greet(Client &client, const Message &message) {
    if (message.type != SIMRIG_HELLO) {
        throw Refused{SIMRIG_BAD_VERSION, "the first request must be a greeting"};
    }
    const Hello hello = std::get<Hello>(decode(message.type, message.body));
    const bool taken = std::any_of(clients_.begin(), clients_.end(), [](const auto &other) {
        return other->connection.role == SIMRIG_ROLE_BOARD;
    });
    if (hello.role == SIMRIG_ROLE_BOARD && taken) {
        throw Refused{SIMRIG_BUSY, "another client is the board"};
    }
    client.connection.role = hello.role;
    BodyWriter reply;
    reply.u32(SIMRIG_OK);
    reply.u16(SIMRIG_VERSION);
    reply.u16(session_.board().has_wall_time() ? 1 : 0);
    reply.text(rig_name_);
    return reply.take();
}

// Snapshots are not recorded themselves. Empty: the request is another one.
std::optional<Body> Server::snapshots(const Message &message) {
    const Words words = message.type == SIMRIG_CONTROL
                            ? words_of(std::string(message.body.begin(), message.body.end()))
                            : Words();
    if (words.empty() || (words[0] != "snapshot" && words[0] != "restore")) {
        return std::nullopt;
    }
    try {
        const std::string &name = word_at(words, 1, "a name for the snapshot");
        no_more_than(words, 2);
        if (words[0] == "snapshot") {
            session_.save(name);
        } else {
            session_.restore(name);
            const bool board = std::any_of(clients_.begin(), clients_.end(), [](const auto &one) {
                return one->connection.role == SIMRIG_ROLE_BOARD;
            });
            if (!board) {
                session_.release();
            }
        }
    } catch (const std::runtime_error &error) {
        return rejection({SIMRIG_FAILED, error.what()});
    }
    return rejection({SIMRIG_OK, ""});
}

void Server::handle(Client &client, const Message &message) {
    Connection &connection = client.connection;
    const auto answer = [&](Body body) {
        connection.send({uint16_t(message.type | SIMRIG_REPLY), message.tag, std::move(body)});
    };
    if (!connection.role) {
        try {
            answer(greet(client, message));
        } catch (const Refused &why) {
            answer(rejection(why));
            connection.finish();
        }
        return;
    }
    if (session_.board().busy() &&
        (message.type == SIMRIG_ADVANCE || message.type == SIMRIG_FRAME_WAIT)) {
        answer(rejection({SIMRIG_BUSY, "another client is letting time pass"}));
        return;
    }
    std::optional<Body> reply = snapshots(message);
    reply = reply ? reply : session_.begin(message.type, message.body, *connection.role);
    if (reply) {
        answer(std::move(*reply));
        return;
    }
    client.waits = true;
    client.type = message.type;
    client.tag = message.tag;
}

void Server::step() {
    std::optional<Body> reply = session_.step();
    behind_ = false;
    if (!reply) {
        return;
    }
    for (const auto &client : clients_) {
        if (client->waits) {
            client->waits = false;
            client->connection.send(
                {uint16_t(client->type | SIMRIG_REPLY), client->tag, std::move(*reply)});
            // Messages received since are handled with the next events, which follow at once.
            serve(*client);
            client->connection.flush();
            return;
        }
    }
}

void Server::drop(size_t number) {
    const Client &client = *clients_[number];
    const bool waited = client.waits;
    const bool was_board = client.connection.role == SIMRIG_ROLE_BOARD;
    clients_.erase(clients_.begin() + long(number));
    if (waited) {
        session_.abandon();
    }
    if (was_board) {
        session_.release();
    }
}

}  // namespace simrig
