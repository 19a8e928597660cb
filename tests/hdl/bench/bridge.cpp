// SPDX-License-Identifier: Apache-2.0
#include "bridge.hpp"

#include <algorithm>
#include <new>

#include "servo_checker.hpp"

namespace hdl {

Bridge::Bridge(uint64_t seed)
    : model_(bridge_model_create(uint32_t(seed ^ seed >> 32))),
      servos_(std::make_unique<ServoChecker>()) {
    if (model_ == nullptr) {
        throw std::bad_alloc();
    }
    bridge_model_get_inputs(model_, &in);
    add(*servos_);
    reset();
}

Bridge::~Bridge() {
    bridge_model_destroy(model_);
}

void Bridge::reset() {
    in.reset = 1;
    drive();
    servos_->on_reset(now());
    run(kUs);
    in.reset = 0;
    drive();
    run(kUs);
}

void Bridge::run(uint64_t duration_ps) {
    const uint64_t end = now() + duration_ps;
    for (;;) {
        end_ps_ = moments_.empty() ? end : std::min(end, moments_.top().time_ps);
        if (now() < end_ps_) {
            // Ends early if a callback sets an earlier time.
            bridge_model_advance(model_, end_ps_ - now());
        }
        bool called = false;
        while (!moments_.empty() && moments_.top().time_ps <= now()) {
            const std::function<void()> what = moments_.top().what;
            moments_.pop();
            what();
            called = true;
        }
        if (now() >= end && !called) {
            break;
        }
    }
    end_ps_ = 0;
}

void Bridge::run_idle(uint64_t duration_ps) {
    const uint64_t end = now() + duration_ps;
    bridge_model_set_idle(model_, 1);
    if (now() < end) {
        run(end - now());
    }
    bridge_model_set_idle(model_, 0);
}

const bridge_outputs &Bridge::out() const {
    bridge_model_get_outputs(model_, &out_);
    return out_;
}

void Bridge::at(uint64_t time_ps, std::function<void()> what) {
    moments_.push({time_ps, order_++, std::move(what)});
    if (time_ps < end_ps_) {
        bridge_model_interrupt(model_);
    }
}

void Bridge::add(Listener &listener) {
    listeners_.push_back(&listener);
    listen();
}

void Bridge::remove(Listener &listener) {
    listeners_.erase(std::find(listeners_.begin(), listeners_.end(), &listener));
    listen();
}

void Bridge::listen() {
    uint32_t wanted = 0;
    for (const Listener *listener : listeners_) {
        wanted |= listener->wanted();
    }
    bridge_model_on_event(model_, wanted, event, this);
    bridge_model_on_clock(model_, clock, this);
}

void Bridge::event(void *self, uint64_t time_ps, uint32_t events, const bridge_outputs *now) {
    for (Listener *listener : static_cast<Bridge *>(self)->listeners_) {
        if ((listener->wanted() & events) != 0) {
            listener->on_event(time_ps, events & listener->wanted(), *now);
        }
    }
}

void Bridge::clock(void *self, uint64_t time_ps, int camera, int level) {
    for (Listener *listener : static_cast<Bridge *>(self)->listeners_) {
        listener->on_pixel_clock(time_ps, camera, level);
    }
}

}  // namespace hdl
