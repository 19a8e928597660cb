// SPDX-License-Identifier: Apache-2.0
/// The video side of an MT9T001 (PIXCLK, frame valid, line valid and ten bits, with its timing),
/// and a receiver like the Blackfin's PPI that knows every expected pixel.
#ifndef VERGENCE_TESTS_HDL_BENCH_PIXEL_SOURCE_HPP
#define VERGENCE_TESTS_HDL_BENCH_PIXEL_SOURCE_HPP

#include <string>
#include <vector>

#include "bridge.hpp"

namespace hdl {

/// A window, and the blanking registers.
struct Window {
    unsigned width = 32, height = 8, hblank = 21, vblank = 3;
    /// P1 + P2 of the sensor without binning; a smaller value, but not below 24, gives a higher
    /// frame rate.
    unsigned fixed = 331 + 38;
    /// Clocks of a row, by the model of the sensor: W + P1 + P2 + HBLANK.
    unsigned row_clocks() const { return width + fixed + hblank; }
    /// Rows of a frame: H + VBLANK + 1.
    unsigned frame_rows() const { return height + vblank + 1; }
    uint64_t frame_clocks() const { return uint64_t(row_clocks()) * frame_rows(); }
};

/// The pixel at a position. The first two of a frame encode camera and frame number.
uint16_t pixel_of(int camera, uint32_t frame, unsigned x, unsigned y);
constexpr uint32_t kFrameNumbers = 1u << 19;

class PixelSource : public Listener {
  public:
    PixelSource(Bridge &bridge, int camera, const Window &window);

    void on_pixel_clock(uint64_t time_ps, int camera, int level) override;
    /// The window from the next frame on.
    void set_window(const Window &window) { next_window_ = window; }
    /// Clock of the sensor; 0: it stops, at any point.
    void set_period(uint32_t period_ps);
    uint32_t period() const { return period_ps_; }
    /// Outputs change after the clock's rise (false, the sensor's default) or fall.
    bool launch_at_fall = false;
    /// Pixels are wrong from their sampling edge until they change.
    bool only_at_edge = false;
    /// Frames begun.
    uint32_t frames() const { return frame_; }
    /// A fault in the next frame: this many pixels or lines missing.
    unsigned missing_pixels = 0, missing_lines = 0;
    const Window &window() const { return window_; }

  private:
    Bridge &bridge_;
    int camera_;
    Window window_, next_window_;
    uint32_t period_ps_ = 0, frame_ = 0;
    unsigned row_ = 0, column_ = 0, short_by_ = 0, lines_short_by_ = 0;
};

/// One frame as received by the DSP.
struct Received {
    uint64_t begin_ps, end_ps;
    std::vector<std::vector<uint16_t>> lines;
};

class PpiReceiver : public Listener {
  public:
    /// Registers itself.
    explicit PpiReceiver(Bridge &bridge);

    uint32_t wanted() const override { return BRIDGE_EVENT_PPI_CLK; }
    void on_event(uint64_t time_ps, uint32_t events, const bridge_outputs &now) override;

    std::vector<Received> frames;
    /// Drops all frames except an unfinished one.
    void forget() { frames.erase(frames.begin(), frames.end() - (in_frame_ ? 1 : 0)); }
    /// Shortest clock phases observed.
    uint64_t shortest_high_ps = UINT64_MAX, shortest_low_ps = UINT64_MAX;
    uint64_t edges = 0;
    /// Line valid outside of frame valid, FS3 high.
    uint64_t broken = 0;

  private:
    bool in_frame_ = false, in_line_ = false;
    uint64_t edge_ps_ = 0;
};

/// Checks which camera's frame this is and every pixel: "" if correct, else what is wrong. camera
/// and number are set if they could be decoded.
std::string check_frame(const Received &frame, const Window &window, int &camera, uint32_t &number);

}  // namespace hdl

#endif
