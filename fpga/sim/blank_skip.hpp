// SPDX-License-Identifier: Apache-2.0
// Edges of a pixel clock that only count. While a camera's pins are constant, for example between
// two lines, its clock soon changes nothing but the divider of clock_meter: every other flip-flop
// of that clock keeps its value. The Verilog itself shows this, by one period whose two edges were
// evaluated without other events between. The same holds for the following periods, as long as
// nothing that these flip-flops read has changed, so their edges can be counted instead of
// evaluated.
#ifndef VERGENCE_FPGA_SIM_BLANK_SKIP_HPP
#define VERGENCE_FPGA_SIM_BLANK_SKIP_HPP

#include <array>
#include <cstdint>
#include <cstring>

#include "verilated_bridge.hpp"

// Other versions of Verilator may name the registers differently; then every edge is evaluated.
#if VERILATOR_VERSION_INTEGER == 5006000

#define CORE(name) root.bridge_sim__DOT__core__DOT__##name
#define VIDEO(name) CORE(video__DOT__##name)

class BlankSkip {
    using Root = Vbridge_sim___024root;

  public:
    explicit BlankSkip(int camera) : camera_(camera) {}
    /// An event after which the period must be evaluated again: a word, an input, a reset.
    void forget() { shown_ = seen_high_ = false; }
    /// The control clock fell, and nothing needed to be evaluated. No flip-flop of a pixel clock
    /// reads its level.
    void fell(Root &root) {
        before_[place(root, root.clk_i)] = root.clk_i;
        before_[place(root, root.__Vtrigrprev__TOP__clk_i)] = root.__Vtrigrprev__TOP__clk_i;
    }

    /// Just after a rising edge of this camera's clock alone was evaluated.
    void rose(Root &root) {
        if (shown_) {
            return;
        }
        if (seen_high_) {
            uint8_t &before = before_[place(root, divider(root))];
            before = (before + 1) & kDivider;
            if (std::memcmp(before_, &root, sizeof before_) == 0) {
                shown_ = true;
                read_ = read(root);
                return;
            }
        }
        seen_high_ = true;
        std::memcpy(before_, &root, sizeof before_);
    }
    /// Whether the next edge, to `level`, of this camera's clock only counts. Another clock sees a
    /// change of the divider's last bit; and while the switch monitors its output for a stop, each
    /// edge of that output ends the monitoring.
    bool counts(Root &root, bool level) const {
        const bool watched =
            (VIDEO(stream__DOT__clocks__DOT__low) | VIDEO(stream__DOT__clocks__DOT__high)) != 0;
        return shown_ && !(watched && drives_ppi(root)) && !(level && (divider(root) & 15u) == 15u);
    }
    /// That clock also drives the PPI.
    bool drives_ppi(Root &root) const {
        return (VIDEO(stream__DOT__clocks__DOT__enabled) >> camera_ & 1u) != 0;
    }
    /// Skips this many rising edges; -1: the last one is evaluated after all.
    void count(Root &root, int rises) {
        uint8_t &counter = divider(root);
        counter = static_cast<uint8_t>(counter + rises) & kDivider;
    }
    /// Just after an edge of the control clock was evaluated.
    void control(Root &root) {
        seen_high_ = false;  // a period must not be compared across it
        shown_ = shown_ && read_ == read(root);
    }

  private:
    static constexpr uint8_t kDivider = 31;
    // Signals of the control clock read by flip-flops of a pixel clock or of the PPI's: ports of
    // camera_channel, stream_switch and their parts that belong to clk_i. The pattern generator is
    // excluded: with it the control clock is selected, and every edge is evaluated.
    using Read = std::array<unsigned, 15>;

    static Read read(Root &root) {
        return {CORE(rst),
                CORE(ppi_mode_edge0),
                CORE(ppi_mode_edge1),
                CORE(expect_width),
                CORE(ppi_mode_sync_shape),
                CORE(ppi_mode_tag),
                CORE(cam_state_active),
                VIDEO(camera0__DOT__record__DOT__was_measuring),
                VIDEO(camera1__DOT__record__DOT__was_measuring),
                VIDEO(stream__DOT__select),
                VIDEO(stream__DOT__gate),
                VIDEO(stream__DOT__gate_reset),
                VIDEO(stream__DOT__forcing),
                VIDEO(stream__DOT__clocks__DOT__busy),
                VIDEO(stream__DOT__clocks__DOT__leg0__DOT__clear)};
    }
    uint8_t &divider(Root &root) const {
        return camera_ == 0 ? VIDEO(camera0__DOT__clock_watch__DOT__divider)
                            : VIDEO(camera1__DOT__clock_watch__DOT__divider);
    }
    static std::size_t place(const Root &root, const uint8_t &byte) {
        return static_cast<std::size_t>(&byte - reinterpret_cast<const uint8_t *>(&root));
    }

    const int camera_;
    bool shown_ = false, seen_high_ = false;
    Read read_{};
    unsigned char before_[sizeof(Root)] = {};
};

#undef VIDEO
#undef CORE

#else

class BlankSkip {
  public:
    explicit BlankSkip(int) {}
    void forget() {}
    template <class Root>
    void fell(Root &) {}
    template <class Root>
    void rose(Root &) {}
    template <class Root>
    bool counts(Root &, bool) const {
        return false;
    }
    template <class Root>
    bool drives_ppi(Root &) const {
        return false;
    }
    template <class Root>
    void count(Root &, int) {}
    template <class Root>
    void control(Root &) {}
};

#endif

#endif
