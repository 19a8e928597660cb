// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/wires.hpp"

#include <algorithm>
#include <new>
#include <utility>

namespace simrig {

Wires::Wires(uint32_t seed, uint64_t begin_ps) : model_(bridge_model_create(seed)) {
    if (model_ == nullptr) {
        throw std::bad_alloc();
    }
    bridge_model_begin_at(model_.get(), begin_ps);
    bridge_model_get_inputs(model_.get(), &in);
}

Wires::~Wires() = default;

void Wires::drive() {
    bridge_model_set_inputs(model_.get(), &in);
}

const bridge_outputs &Wires::out() {
    bridge_model_get_outputs(model_.get(), &out_);
    return out_;
}

void Wires::run_until(uint64_t time_ps) {
    stopped_ = false;
    while (!stopped_) {
        end_ps_ = moments_.empty() ? time_ps : std::min(time_ps, moments_.top().time_ps);
        if (now_ps() < end_ps_) {
            // Ends early when a callback sets an earlier timer, or stops.
            bridge_model_advance(model_.get(), end_ps_ - now_ps());
        }
        bool called = false;
        while (!stopped_ && !moments_.empty() && moments_.top().time_ps <= now_ps()) {
            const std::function<void()> what = moments_.top().what;
            moments_.pop();
            what();
            called = true;
        }
        if (now_ps() >= time_ps && !called) {
            break;
        }
    }
    end_ps_ = 0;
}

void Wires::run(uint64_t duration_ps) {
    const uint64_t end_ps = now_ps() + duration_ps;
    while (now_ps() < end_ps) {
        run_until(end_ps);
    }
}

void Wires::at(uint64_t time_ps, std::function<void()> what) {
    moments_.push({time_ps, order_++, std::move(what)});
    if (time_ps < end_ps_) {
        bridge_model_interrupt(model_.get());
    }
}

void Wires::set_idle(bool idle) {
    if (idle != idle_) {
        idle_ = idle;
        bridge_model_set_idle(model_.get(), idle);
    }
}

void Wires::set_clock(int clock, uint32_t period_ps) {
    bridge_model_set_clock(model_.get(), clock, period_ps);
}

void Wires::listen(PinListener &listener) {
    listeners_.push_back({&listener, listener.wanted()});
    uint32_t wanted = 0;
    for (const Listening &each : listeners_) {
        wanted |= each.wanted;
    }
    bridge_model_on_event(model_.get(), wanted, pins, this);
}

void Wires::listen_clock(int camera, ClockListener &listener) {
    clock_listeners_[camera] = &listener;
    bridge_model_on_clock(model_.get(), clock, this);
}

void Wires::listen_ppi(PpiListener &listener) {
    ppi_listener_ = &listener;
    bridge_model_on_ppi(model_.get(), ppi, this);
}

void Wires::end_if_stopped() {
    if (stopped_) {
        bridge_model_interrupt(model_.get());
    }
}

void Wires::pins(void *self, uint64_t time_ps, uint32_t groups, const bridge_outputs *now) {
    auto *wires = static_cast<Wires *>(self);
    for (const Listening &each : wires->listeners_) {
        if ((each.wanted & groups) != 0) {
            each.listener->on_pins(time_ps, groups & each.wanted, *now);
        }
    }
    wires->end_if_stopped();
}

void Wires::clock(void *self, uint64_t time_ps, int camera, int level) {
    (void)level;
    auto *wires = static_cast<Wires *>(self);
    if (wires->clock_listeners_[camera] != nullptr) {
        wires->clock_listeners_[camera]->on_clock(time_ps, camera);
    }
    wires->end_if_stopped();
}

void Wires::ppi(void *self, uint64_t time_ps, const uint16_t *data, size_t count,
                const bridge_outputs *now) {
    auto *wires = static_cast<Wires *>(self);
    wires->ppi_listener_->on_run(time_ps, data, count, *now);
    wires->end_if_stopped();
}

}  // namespace simrig
