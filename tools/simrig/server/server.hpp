// SPDX-License-Identifier: Apache-2.0
/// Serves a board to clients on a Unix or TCP socket.
#ifndef VERGENCE_SIMRIG_SERVER_SERVER_HPP
#define VERGENCE_SIMRIG_SERVER_SERVER_HPP

#include <memory>
#include <string>
#include <vector>

#include "tools/simrig/server/board.hpp"
#include "tools/simrig/server/connection.hpp"
#include "tools/simrig/server/log.hpp"

namespace simrig {

/// Where clients come to: "unix:PATH" or "tcp:PORT" (loopback only; port 0: any free one). Throws
/// std::runtime_error with one line that says what is wrong.
class Listener {
  public:
    explicit Listener(const std::string &where);
    ~Listener();
    Listener(const Listener &) = delete;
    Listener &operator=(const Listener &) = delete;
    int socket() const { return socket_; }
    /// As a client would write it; with the port that was found.
    const std::string &name() const { return name_; }

  private:
    void listen_unix(const std::string &path);
    void listen_tcp(const std::string &port);

    int socket_ = -1;
    std::string name_, path_;
};

class Server {
  public:
    /// tick: called between steps, for wall time and the pseudo terminal; may be empty.
    /// log: gets every request that the board has answered; may be null.
    Server(Listener &listener, Board &board, std::function<void()> tick,
           std::vector<LogEntry> *log);

    /// Serves until stop_pipe has something to read.
    void run(int stop_pipe);

  private:
    struct Client {
        explicit Client(int socket) : connection(socket) {}
        Connection connection;
        bool waits = false;  ///< for the board's step
        uint16_t type = 0, tag = 0;
        Body asked;
    };
    void accept_client();
    bool serve(Client &client);
    void answer(Client &client, uint16_t type, uint16_t tag, Body body);
    void handle(Client &client, const Message &message);
    void record(const Client &client, uint16_t type, const Body &asked, const Body &reply);
    void drop(size_t number);
    void step();

    Listener &listener_;
    Board &board_;
    std::function<void()> tick_;
    std::vector<LogEntry> *log_;
    std::vector<std::unique_ptr<Client>> clients_;
};

}  // namespace simrig

#endif
