// SPDX-License-Identifier: Apache-2.0
// Edges of a pixel clock that only count. While a camera shows one word, such as between two lines,
// its clock soon changes nothing but the divider of clock_meter: every other flip-flop of that
// clock keeps what it holds. The Verilog itself shows it, by one period whose both edges were
// evaluated with nothing else between; the same holds for the periods to come, as long as nothing
// that these flip-flops read has changed, and their edges can be counted instead of evaluated.
#ifndef VERGENCE_FPGA_SIM_BLANK_SKIP_HPP
#define VERGENCE_FPGA_SIM_BLANK_SKIP_HPP

#include <array>
#include <cstdint>
#include <cstring>

#include "verilated_bridge.hpp"

// Other versions of Verilator may call the registers by other names, and evaluate every edge.
#if VERILATOR_VERSION_INTEGER == 5006000

#define CORE(name) root.bridge_sim__DOT__core__DOT__##name
#define VIDEO(name) CORE(video__DOT__##name)

class BlankSkip {
    using Root = Vbridge_sim___024root;

  public:
    explicit BlankSkip(int camera) : camera_(camera) {}
    /// Something happened after which the period must be shown anew: a word, an input, a reset.
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
    /// Whether the next edge, to `level`, of this camera's clock only counts. Where the divider's
    /// last bit changes another clock can see it, and while the switch watches its output stand,
    /// each edge of that output ends the watch.
    bool counts(Root &root, bool level) const {
        const bool watched =
            (VIDEO(stream__DOT__clocks__DOT__low) | VIDEO(stream__DOT__clocks__DOT__high)) != 0;
        return shown_ && !(watched && drives_ppi(root)) && !(level && (divider(root) & 15u) == 15u);
    }
    /// That clock goes on to the PPI.
    bool drives_ppi(Root &root) const {
        return (VIDEO(stream__DOT__clocks__DOT__enabled) >> camera_ & 1u) != 0;
    }
    /// So many rising edges pass; -1: the last one is to be evaluated after all.
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
    // What flip-flops of a pixel clock, and of the PPI's, read of the control clock's: ports of
    // camera_channel, stream_switch and their parts that belong to clk_i. The pattern generator
    // is not among them: it has the control clock, and then every edge is evaluated.
    using Read = std::array<unsigned, 15>;

    static Read read(Root &root) {
        return {CORE(rst),
                CORE(ppi_mode_edge0),
                CORE(ppi_mode_edge1),
                CORE(expect_width),
                CORE(ppi_mode_sync_shape),
                CORE(ppi_mode_tag),
                CORE(cam_active),
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
