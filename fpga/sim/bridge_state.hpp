// SPDX-License-Identifier: Apache-2.0
// The state of a model, and its pins: from the inputs to the Verilated core, and from there to the
// outputs and to what changed.
#ifndef VERGENCE_FPGA_SIM_BRIDGE_STATE_HPP
#define VERGENCE_FPGA_SIM_BRIDGE_STATE_HPP

#include <memory>

#include "blank_skip.hpp"
#include "bridge_model.h"
#include "idle_skip.hpp"
#include "verilated_bridge.hpp"

namespace bridge {

constexpr uint64_t kNever = UINT64_MAX;

struct Clock {
    uint32_t period_ps = 0;
    uint64_t next_ps = kNever;
    bool level = false;
};

// The Verilated outputs, one word an event group.
struct Pins {
    uint8_t sda_low, branch_low, servo, irq, ppi_clk;
    uint16_t ppi, sensor;
};

constexpr size_t kRun = 4096;
constexpr unsigned kSyncs = 7;

// The pins of a camera as set by bridge_model_feed().
struct Feed {
    bool used = false;
    int level = 0;
    uint16_t word = 0;
    const uint16_t *next = nullptr, *end = nullptr;
};

}  // namespace bridge

struct bridge_model {
    VerilatedContext context;
    std::unique_ptr<Vbridge_sim> top;
    bridge_inputs inputs{};
    bridge_outputs outputs{};
    bridge::Pins pins{};
    bridge::Clock clocks[BRIDGE_CLOCKS];
    uint64_t now_ps = 0;
    uint32_t control_period_ps = BRIDGE_CONTROL_PERIOD_PS;
    // Clocks since the microsecond began; the edge that ends it brings the tick.
    unsigned phase = 0;
    bool idle = false;
    bool interrupted = false;
    bool inputs_changed = true;
    bool unsettled = false;  // inputs were applied and no event has come since
    bool stepping = false;   // no clock is skipped
    bool resting = false;    // the state of the cameras' clock monitors is frozen
    IdleSkip skip;
    BlankSkip blank[BRIDGE_CAMERAS] = {BlankSkip(0), BlankSkip(1)};
    bool pending = false;  // an edge of a camera's clock was counted that the core has not seen
    uint32_t wanted = 0;
    bridge_event_callback on_event = nullptr;
    void *event_context = nullptr;
    bridge_clock_callback on_clock = nullptr;
    void *clock_context = nullptr;
    bridge::Feed feeds[BRIDGE_CAMERAS];
    bridge_ppi_callback on_ppi = nullptr;
    void *ppi_context = nullptr;
    unsigned run_syncs = 0;
    size_t run_count = 0;
    uint16_t run[bridge::kRun];
};

namespace bridge {

inline unsigned word_of(const bridge_model &model, int camera) {
    const bridge_inputs &in = model.inputs;
    return model.feeds[camera].used
               ? model.feeds[camera].word
               : (in.pixel[camera] & 0x3FFu) | (in.line_valid[camera] & 1u) << 10 |
                     (in.frame_valid[camera] & 1u) << 11;
}

inline void apply_words(bridge_model &model) {
    const unsigned left = word_of(model, BRIDGE_LEFT), right = word_of(model, BRIDGE_RIGHT);
    Vbridge_sim &top = *model.top;
    top.frame_valid_i = static_cast<uint8_t>((left >> 11 & 1u) | (right >> 10 & 2u));
    top.line_valid_i = static_cast<uint8_t>((left >> 10 & 1u) | (right >> 9 & 2u));
    top.left_data_i = left & 0x3FFu;
    top.right_data_i = right & 0x3FFu;
}

inline void apply_inputs(bridge_model &model) {
    model.top->rst_i = model.inputs.reset;
    apply_words(model);
    model.inputs_changed = false;
    model.unsettled = true;
    for (BlankSkip &blank : model.blank) {
        blank.forget();
    }
}

// The levels of the bus lines result from both sides.
inline void join_lines(bridge_model &model) {
    const bridge_inputs &in = model.inputs;
    const unsigned low = model.top->branch_low_o;
    bridge_outputs &out = model.outputs;
    out.scl = in.scl;
    out.sda = in.sda & static_cast<uint8_t>(!model.top->sda_low_o);
    for (unsigned i = 0; i < 2; i++) {
        out.branch_scl[i] = in.branch_scl[i] & static_cast<uint8_t>(~(low >> i) & 1u);
        out.branch_sda[i] = in.branch_sda[i] & static_cast<uint8_t>(~(low >> (i + 2)) & 1u);
    }
    model.top->scl_i = out.scl ^ in.scl_noise;
    model.top->sda_i = out.sda ^ in.sda_noise;
    model.top->branch_scl_i = static_cast<uint8_t>(out.branch_scl[0] | out.branch_scl[1] << 1);
    model.top->branch_sda_i = static_cast<uint8_t>(out.branch_sda[0] | out.branch_sda[1] << 1);
}

inline void spread(uint8_t (&pair)[2], unsigned bits) {
    pair[0] = bits & 1u;
    pair[1] = bits >> 1 & 1u;
}

// Compares the outputs with the previous ones; returns the groups that changed.
inline uint32_t collect(bridge_model &model) {
    const Vbridge_sim &top = *model.top;
    const Pins now = {top.sda_low_o, top.branch_low_o, top.servo_o, top.irq_o,
                      top.ppi_clk_o, top.ppi_o,        top.sensor_o};
    const Pins was = model.pins;
    bridge_outputs &out = model.outputs;
    uint32_t events = 0;
    if (now.servo != was.servo) {
        spread(out.servo, now.servo);
        events |= BRIDGE_EVENT_SERVO;
    }
    if (now.irq != was.irq) {
        out.irq = now.irq;
        events |= BRIDGE_EVENT_IRQ;
    }
    if (now.ppi_clk != was.ppi_clk) {
        out.ppi_clk = now.ppi_clk;
        events |= BRIDGE_EVENT_PPI_CLK;
    }
    if (now.ppi != was.ppi) {
        out.ppi_data = now.ppi & 0x3FFu;
        out.ppi_fs1 = now.ppi >> 10 & 1u;
        out.ppi_fs2 = now.ppi >> 11 & 1u;
        out.ppi_fs3 = now.ppi >> 12 & 1u;
        events |= BRIDGE_EVENT_PPI;
    }
    if (now.sensor != was.sensor) {
        spread(out.sensor_reset_n, now.sensor);
        spread(out.sensor_standby, now.sensor >> 2);
        spread(out.sensor_oe, now.sensor >> 4);
        spread(out.sensor_extclk_enable, now.sensor >> 6);
        spread(out.trigger, now.sensor >> 8);
        events |= BRIDGE_EVENT_SENSOR;
    }
    if (now.sda_low != was.sda_low || now.branch_low != was.branch_low) {
        if (now.sda_low != was.sda_low) {
            events |= BRIDGE_EVENT_BUS;
        }
        if (now.branch_low != was.branch_low) {
            events |= BRIDGE_EVENT_BRANCH;
        }
        join_lines(model);
    }
    model.pins = now;
    return events;
}

// At a rising edge of the PPI's clock.
inline void sample_ppi(bridge_model &model) {
    const unsigned syncs = model.pins.ppi >> 10 & kSyncs;
    if (syncs != model.run_syncs || model.run_count == kRun) {
        model.on_ppi(model.ppi_context, model.now_ps, model.run, model.run_count, &model.outputs);
        model.run_syncs = syncs;
        model.run_count = 0;
    }
    model.run[model.run_count++] = model.pins.ppi & 0x3FFu;
}

}  // namespace bridge

#endif
