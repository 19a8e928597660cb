// SPDX-License-Identifier: Apache-2.0
/// Checks every servo edge of every test. No pulse may leave the hardware's limits, whatever the
/// test does to the bridge; frames without a gap can be required.
#ifndef VERGENCE_TESTS_HDL_BENCH_SERVO_CHECKER_HPP
#define VERGENCE_TESTS_HDL_BENCH_SERVO_CHECKER_HPP

#include <string>
#include <vector>

#include "bridge.hpp"

namespace hdl {

/// One pulse, in ps.
struct Pulse {
    uint64_t rise_ps, fall_ps;
    uint64_t width_ps() const { return fall_ps - rise_ps; }
};

class ServoChecker : public Listener {
  public:
    static constexpr uint64_t kShortest = 600 * kUs, kLongest = 2400 * kUs;

    uint32_t wanted() const override { return BRIDGE_EVENT_SERVO; }
    void on_event(uint64_t time_ps, uint32_t events, const bridge_outputs &now) override;
    /// The board's reset ends a pulse at once; only that pulse may be short.
    void on_reset(uint64_t time_ps);
    /// From now on every frame of the servo must have its pulse; 0: no longer required.
    void demand(int servo, uint64_t period_ps);
    /// Whether a required pulse is late now.
    void look(uint64_t time_ps);

    const std::vector<Pulse> &pulses(int servo) const { return pulses_[servo]; }
    /// Errors found; empty if none.
    const std::vector<std::string> &faults() const { return faults_; }

  private:
    void fault(int servo, uint64_t time_ps, const std::string &what);

    std::vector<Pulse> pulses_[BRIDGE_SERVOS];
    uint64_t rise_ps_[BRIDGE_SERVOS] = {}, period_ps_[BRIDGE_SERVOS] = {};
    bool high_[BRIDGE_SERVOS] = {}, demanded_before_[BRIDGE_SERVOS] = {};
    uint64_t reset_ps_ = UINT64_MAX;
    std::vector<std::string> faults_;
};

}  // namespace hdl

#endif
