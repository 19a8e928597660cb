// SPDX-License-Identifier: Apache-2.0
/// Executes the requests of the protocol on a rig: bytes in, bytes out, no sockets. Requests that
/// advance time may take long; they run in steps so that a server can serve other clients.
#ifndef VERGENCE_SIMRIG_SERVER_BOARD_HPP
#define VERGENCE_SIMRIG_SERVER_BOARD_HPP

#include <functional>
#include <optional>
#include <string>

#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/server/control.hpp"
#include "tools/simrig/wire/request.hpp"

namespace simrig {

/// The rig's time by the machine's clock, in microseconds; empty: only requests advance time.
using WallClock = std::function<double()>;

class Board {
  public:
    Board(Rig &rig, ControlServer &control_connection, WallClock clock);

    /// Starts a request of a client that has greeted. Empty: it continues in step().
    std::optional<Body> begin(uint16_t type, const Body &body, simrig_role role);
    bool busy() const { return pending_.has_value(); }
    /// Continues for a slice of the rig's time. Empty: not done yet.
    std::optional<Body> step();
    /// The client that waits for step() disconnected.
    void abandon() { pending_.reset(); }
    /// The board's client disconnected.
    void release();
    double now_us() const { return rig_.now_us(); }
    uint64_t now_ps() const { return rig_.now_ps(); }

    bool has_wall_time() const { return bool(clock_); }
    /// With wall time and nothing to step: lets it pass. True: the rig is behind the clock.
    bool keep_up();

  private:
    struct Pending {
        bool for_frame;
        double until_us;
        uint32_t wake;
    };
    // One function per request; empty: it continues in step(). Throw Refused.
    using Answer = std::optional<Body>;
    Answer answer(const Hello &hello);
    Answer answer(const AskTime &ask);
    Answer answer(const Advance &advance);
    Answer answer(const Transfer &transfer);
    Answer answer(const GpioSet &set);
    Answer answer(const GpioGet &get);
    Answer answer(const FrameArm &arm);
    Answer answer(const FrameWait &wait);
    Answer answer(const FrameCancel &cancel);
    Answer answer(const SerialWrite &write);
    Answer answer(const SerialRead &read);
    Answer answer(const ControlLine &line);
    Answer answer(const AskTruth &ask);
    Answer answer(const AskTruthRows &ask);

    template <typename Ask>
    static auto at_control(Ask ask) -> decltype(ask());
    uint32_t there_already(uint32_t wake);
    double slice_end(double until_us) const;
    Body time_and(uint32_t woken) const;
    Body frame();

    Rig &rig_;
    ControlServer &control_server_;
    WallClock clock_;
    std::optional<Pending> pending_;
};

}  // namespace simrig

#endif
