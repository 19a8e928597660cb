// SPDX-License-Identifier: Apache-2.0
/// The bridge's pins and their time: devices set inputs at given times and are called on changes of
/// outputs.
#ifndef VERGENCE_SIMRIG_RIG_WIRES_HPP
#define VERGENCE_SIMRIG_RIG_WIRES_HPP

#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <vector>

#include "bridge_model.h"

namespace simrig {

constexpr uint64_t kPsPerUs = 1000000;

/// Microseconds; a whole number of them stays one, which no quotient of doubles promises.
inline double us_of(uint64_t time_ps) {
    return double(time_ps / kPsPerUs) + double(time_ps % kPsPerUs) / double(kPsPerUs);
}

/// Called when pins of the groups in wanted() have changed.
class PinListener {
  public:
    virtual ~PinListener() = default;
    virtual uint32_t wanted() const = 0;
    virtual void on_pins(uint64_t time_ps, uint32_t groups, const bridge_outputs &now) = 0;
};

/// Supplies the pins of a camera. Called just after an edge of its clock when the words that
/// it gave with Wires::feed() are used up.
class ClockListener {
  public:
    virtual ~ClockListener() = default;
    virtual void on_clock(uint64_t time_ps, int camera) = 0;
};

/// Receives the PPI's samples: see bridge_ppi_callback.
class PpiListener {
  public:
    virtual ~PpiListener() = default;
    virtual void on_run(uint64_t time_ps, const uint16_t *data, size_t count,
                        const bridge_outputs &now) = 0;
};

class Wires {
  public:
    /// Time begins at begin_ps.
    Wires(uint32_t seed, uint64_t begin_ps);
    ~Wires();
    Wires(const Wires &) = delete;
    Wires &operator=(const Wires &) = delete;

    /// The inputs; a change takes effect with drive().
    bridge_inputs in{};
    void drive();
    /// The wires as of now.
    const bridge_outputs &out();

    uint64_t now_ps() const { return bridge_model_time_ps(model_.get()); }
    double now_us() const { return us_of(now_ps()); }
    /// Advances time until then, with all timers on the way. Returns early when stop() is called.
    void run_until(uint64_t time_ps);
    /// The same, ignoring stop().
    void run(uint64_t duration_ps);
    void stop() { stopped_ = true; }
    bool stopped() const { return stopped_; }

    /// Calls `what` at that time, or at once when it is past, from run_until().
    void at(uint64_t time_ps, std::function<void()> what);

    /// Timers at a control clock of one period a microsecond: see bridge_model_set_idle().
    void set_idle(bool idle);
    bool idle() const { return idle_; }
    /// Idle time in which clocks that are alive need not be shown: see bridge_model_may_rest().
    bool may_rest(unsigned alive) const { return bridge_model_may_rest(model_.get(), alive) != 0; }
    void set_resting(bool resting) {
        resting_ = resting;
        bridge_model_set_resting(model_.get(), resting);
    }
    bool resting() const { return resting_; }
    void set_clock(int clock, uint32_t period_ps);
    /// See bridge_model_feed(), bridge_model_show(), bridge_model_watched().
    void feed(int camera, const std::vector<uint16_t> &words, bool level) {
        bridge_model_feed(model_.get(), camera, words.data(), words.size(), level);
    }
    void show(int camera, uint16_t word) { bridge_model_show(model_.get(), camera, word); }
    unsigned watched() const { return bridge_model_watched(model_.get()); }

    /// Listeners cannot be removed; the caller owns them.
    void listen(PinListener &listener);
    void listen_clock(int camera, ClockListener &listener);
    void listen_ppi(PpiListener &listener);

  private:
    struct Moment {
        uint64_t time_ps, order;
        std::function<void()> what;
        bool operator<(const Moment &other) const {
            return time_ps != other.time_ps ? time_ps > other.time_ps : order > other.order;
        }
    };
    struct Destroy {
        void operator()(bridge_model *model) const { bridge_model_destroy(model); }
    };
    static void pins(void *self, uint64_t time_ps, uint32_t groups, const bridge_outputs *now);
    static void clock(void *self, uint64_t time_ps, int camera, int level);
    static void ppi(void *self, uint64_t time_ps, const uint16_t *data, size_t count,
                    const bridge_outputs *now);
    void end_if_stopped();

    std::unique_ptr<bridge_model, Destroy> model_;
    bridge_outputs out_{};
    std::priority_queue<Moment> moments_;
    struct Listening {
        PinListener *listener;
        uint32_t wanted;
    };
    std::vector<Listening> listeners_;
    ClockListener *clock_listeners_[BRIDGE_CAMERAS] = {};
    PpiListener *ppi_listener_ = nullptr;
    uint64_t order_ = 0, end_ps_ = 0;
    bool stopped_ = false, idle_ = false, resting_ = false;
};

}  // namespace simrig

#endif
