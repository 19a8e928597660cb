// SPDX-License-Identifier: Apache-2.0
/// The simulated bridge with the environment of every test: a queue of events, listeners, and a
/// checker of the servo pulses that is always active.
#ifndef VERGENCE_TESTS_HDL_BENCH_BRIDGE_HPP
#define VERGENCE_TESTS_HDL_BENCH_BRIDGE_HPP

#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <vector>

#include "bridge_model.h"

namespace hdl {

constexpr uint64_t kNs = 1000, kUs = 1000 * kNs, kMs = 1000 * kUs;

/// Receives events. Calls come during an advance: it may set inputs and event times.
class Listener {
  public:
    virtual ~Listener() = default;
    /// The groups (BRIDGE_EVENT_*) to receive.
    virtual uint32_t wanted() const { return 0; }
    virtual void on_event(uint64_t, uint32_t, const bridge_outputs &) {}
    /// After an edge of a camera's clock.
    virtual void on_pixel_clock(uint64_t, int, int) {}
};

class ServoChecker;

class Bridge {
  public:
    explicit Bridge(uint64_t seed);
    ~Bridge();
    Bridge(const Bridge &) = delete;
    Bridge &operator=(const Bridge &) = delete;

    /// Activates the board's reset for a microsecond.
    void reset();
    /// Simulates a duration.
    void run(uint64_t duration_ps);
    /// The same 25 times cheaper (see bridge_model.h); returns to the exact clock at the end.
    void run_idle(uint64_t duration_ps);
    uint64_t now() const { return bridge_model_time_ps(model_); }
    const bridge_outputs &out() const;
    /// The inputs. Changes take effect with drive().
    bridge_inputs in{};
    void drive() { bridge_model_set_inputs(model_, &in); }
    /// Calls at a given time; also from a callback.
    void at(uint64_t time_ps, std::function<void()> what);
    /// The listener must outlive the bridge, or call remove().
    void add(Listener &listener);
    void remove(Listener &listener);
    void set_clock(int clock, uint32_t period_ps) {
        bridge_model_set_clock(model_, clock, period_ps);
    }
    ServoChecker &servos() { return *servos_; }
    bridge_model *model() { return model_; }

  private:
    struct Moment {
        uint64_t time_ps, order;
        std::function<void()> what;
        bool operator>(const Moment &other) const {
            return time_ps != other.time_ps ? time_ps > other.time_ps : order > other.order;
        }
    };
    static void event(void *self, uint64_t time_ps, uint32_t events, const bridge_outputs *now);
    static void clock(void *self, uint64_t time_ps, int camera, int level);
    void listen();

    bridge_model *model_;
    mutable bridge_outputs out_{};
    std::vector<Listener *> listeners_;
    std::priority_queue<Moment, std::vector<Moment>, std::greater<Moment>> moments_;
    uint64_t order_ = 0, end_ps_ = 0;
    std::unique_ptr<ServoChecker> servos_;
};

}  // namespace hdl

#endif
