// SPDX-License-Identifier: Apache-2.0
/// The instrument on a simulated rig, as in the daemon.
#ifndef VERGENCE_TESTS_RIG_BENCH_RIG_BENCH_HPP
#define VERGENCE_TESTS_RIG_BENCH_RIG_BENCH_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/faulty_ports.hpp"
#include "bench/simrig_process.hpp"
#include "core/error.h"
#include "daemon/backends/sim/sim_backend.h"
#include "rig/pair.h"
#include "rig/rig.h"

namespace rig_bench {

/// The profile "rig" with frames of this size, so that a test takes seconds instead of minutes.
rig_profile small_profile(uint16_t width_px = 128, uint16_t height_px = 96);

class RigBench {
  public:
    explicit RigBench(const rig_profile &profile = small_profile(), const std::string &scene = "");
    ~RigBench();
    RigBench(const RigBench &) = delete;
    RigBench &operator=(const RigBench &) = delete;

    uint64_t now_us();
    void advance_ms(uint64_t time_ms);
    /// Advances in the daemon's steps, with rig_serve at each. Returns its first error.
    int idle_ms(uint64_t time_ms);
    /// Sends a command to simrig's control connection; returns the reply.
    std::string control(const std::string &command);
    /// A pair of the present window, whose images exist until the next one.
    int capture(::pair &pair, bool check_static = false);
    double mean(const pair_frame &frame) const;
    /// Runs a command as typed by a user; `message` is what is shown of an error.
    int run(const std::string &line, std::string &message);

    SimrigProcess process;
    sim_backend backend{};
    sim_connection control_connection{};  ///< a second connection, for injecting faults
    FaultyPorts faulty;
    ::rig rig{};
    std::vector<std::string> logged;
    std::function<bool()> keep_going = [] { return true; };

  private:
    hal_log log_;
    pair_frame taken_[RIG_SIDES] = {};  ///< the last pair
};

}  // namespace rig_bench

#endif
