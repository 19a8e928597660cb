// SPDX-License-Identifier: Apache-2.0
/// Serves a session to clients.
#ifndef VERGENCE_SIMRIG_SERVER_SERVER_HPP
#define VERGENCE_SIMRIG_SERVER_SERVER_HPP

#include <memory>
#include <string>
#include <vector>

#include "tools/simrig/server/listener.hpp"
#include "tools/simrig/server/session.hpp"

namespace simrig {

class Server {
  public:
    /// rig_name: part of the reply to a greeting. tick: called between steps, for the pseudo
    /// terminal; may be empty.
    Server(Listener &listener, Session &session, std::string rig_name, std::function<void()> tick);

    /// Serves until stop_pipe is readable.
    void run(int stop_pipe);

  private:
    struct Client {
        explicit Client(int socket) : connection(socket) {}
        Connection connection;
        bool waits = false;   ///< it waits for the end of the session's step
        bool silent = false;  ///< it sends no more
        uint16_t type = 0, tag = 0;
    };
    void wait_for_events(int stop_pipe);
    int timeout_ms() const;
    void accept_client();
    bool service(Client &client, short seen);
    void serve(Client &client);
    void handle(Client &client, const Message &message);
    Body greet(Client &client, const Message &message);
    std::optional<Body> snapshots(const Message &message);
    void drop(size_t number);
    void step();

    Listener &listener_;
    Session &session_;
    std::string rig_name_;
    std::function<void()> tick_;
    std::vector<std::unique_ptr<Client>> clients_;
    bool stop_ = false, connection_pending_ = false, behind_ = false;
};

}  // namespace simrig

#endif
