// SPDX-License-Identifier: Apache-2.0
/// The socket that accepts clients.
#ifndef VERGENCE_SIMRIG_SERVER_LISTENER_HPP
#define VERGENCE_SIMRIG_SERVER_LISTENER_HPP

#include <cstdint>
#include <string>

namespace simrig {

/// "unix:PATH" (for this user alone) or "tcp:PORT" (loopback only; port 0: any free one). Throws
/// std::runtime_error with one line that says what is wrong.
class Listener {
  public:
    explicit Listener(const std::string &where);
    /// Why `where` is not a valid address, in one line; empty: it is valid.
    static std::string wrong_place(const std::string &where);
    ~Listener();
    Listener(const Listener &) = delete;
    Listener &operator=(const Listener &) = delete;
    int socket() const { return socket_; }
    /// As a client writes it, with the actual port.
    const std::string &name() const { return name_; }

  private:
    void listen_unix(const std::string &path);
    void listen_tcp(uint16_t port);

    int socket_ = -1;
    std::string name_, path_;
};

}  // namespace simrig

#endif
