// SPDX-License-Identifier: Apache-2.0
//
// The pixel path alone (fpga/rtl/video_path.v): two cameras whose clocks drift, stop high or low in
// the middle of anything and come back at any moment, and requests to switch at any moment. Every
// frame that the DSP receives must be one that a source sent, bit for bit, or be flagged as cut; no
// phase of the PPI clock may be shorter than that phase of a source.
//
//   verilator --cc --exe --build --x-initial unique --x-assign unique -DSIM_RANDOM_DELAY -y
//   fpga/rtl
//     --top-module video_path -CFLAGS "-std=c++17 -O2 -I$PWD/tests/hdl" fpga/rtl/video_path.v
//     $PWD/tests/hdl/video_path.cpp -o video_path
//   obj_dir/video_path [switches [seed]]
#include <verilated.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "Vvideo_path.h"
#include "video_path_world.hpp"

namespace {

using namespace video_path;

/** The model with its clocks and everything that watches it. */
class Bench {
  public:
    Bench(const Mode &mode, std::mt19937_64 &random)
        : mode_(mode),
          random_(random),
          left_(0, mode, random),
          right_(1, mode, random),
          cameras_{&left_, &right_},
          receiver_(mode, cameras_) {
        auto &m = *model_;
        m.stream_i = 1;
        m.request_i = 0;
        m.alternating_i = mode.alternating;
        m.frames_each_i = 2;
        m.timeout_ms_i = mode.long_frames ? 1 : 3;
        m.first_line_i = mode.first_line_sync;
        m.tag_i = mode.tag;
        m.falling_i =
            static_cast<unsigned>(mode.falling[0]) | static_cast<unsigned>(mode.falling[1]) << 1;
        m.wanted_i = 3;
        m.hold_i = 0;
        m.expect_width_i = mode.wrong_sizes ? mode.width : 0;
        m.expect_height_i = mode.wrong_sizes ? mode.height : 0;
        m.pattern_width_i = mode.width;
        m.pattern_height_i = mode.height;
        m.pattern_hblank_i = mode.line_blanking;
        m.pattern_vblank_i = 2;
        m.pattern_kind_i = 0;
        m.pattern_seed_i = 1;
        m.tick_us_i = 1;  // a clock is a microsecond: time-outs are short
        // A clear is a level in hardware but an edge to the simulator: a reset synchroniser that
        // starts at 1 by chance gives none. So all domains are clocked once, and reset again.
        m.clk_i = m.camera0_clk_i = m.camera1_clk_i = 0;
        for (int i = 0; i < 2; ++i) {
            m.rst_i = 0;
            m.eval();
            m.rst_i = 1;
            m.eval();
            for (int k = 0; k < 8; ++k)
                step();
            m.rst_i = 0;
            if (i == 0)
                run_for(5'000'000);
        }
        left_.count_anew();
        right_.count_anew();
        checking_ = true;
    }

    ~Bench() { model_->final(); }

    void run_for(Picoseconds time) {
        const Picoseconds end = now_ + time;
        while (now_ < end)
            step();
    }

    /** Asks for a source. */
    void request(int source) { model_->request_i = static_cast<unsigned>(source); }

    Vvideo_path &model() { return *model_; }
    Receiver &receiver() { return receiver_; }
    Camera &camera(int i) { return *cameras_[static_cast<std::size_t>(i)]; }
    Picoseconds now() const { return now_; }
    int switched = 0, timed_out = 0, lost = 0, cuts = 0, errors = 0;
    Picoseconds shortest_high = INT64_MAX, shortest_low = INT64_MAX;
    Picoseconds longest_switch = 0;

  private:
    void step() {
        auto &m = *model_;
        const Picoseconds next = std::min({next_control_, left_.next_event(), right_.next_event()});
        now_ = next;
        left_.advance(now_);
        right_.advance(now_);
        const bool control = now_ == next_control_;
        if (control) {
            m.clk_i = !m.clk_i;
            next_control_ += kControlHalf;
        }
        if (control && m.clk_i)
            before_control_edge();
        m.camera0_clk_i = left_.clock;
        m.camera0_data_i = static_cast<unsigned>(left_.data);
        m.camera0_line_i = left_.line;
        m.camera0_frame_i = left_.frame;
        m.camera1_clk_i = right_.clock;
        m.camera1_data_i = static_cast<unsigned>(right_.data);
        m.camera1_line_i = right_.line;
        m.camera1_frame_i = right_.frame;
        const bool line = m.ppi_line_o, sync = m.ppi_frame_o;
        const int data = m.ppi_data_o;
        m.eval();
        watch_clock(line, sync, data);
        if (control && m.clk_i)
            after_control_edge();
    }

    void before_control_edge() {
        auto &m = *model_;
        switched += m.event_switched_o;
        timed_out += m.event_timed_out_o;
        lost += m.event_clock_lost_o;
        errors += m.event_line_error_o;
        if (m.switching_o && began_ < 0)
            began_ = now_;
        if (!m.switching_o && began_ >= 0) {
            longest_switch = std::max(longest_switch, now_ - began_);
            began_ = -1;
        }
    }

    void after_control_edge() {
        auto &m = *model_;
        ++clocks_;
        m.tick_ms_i = clocks_ % 1000 == 0;
        m.time_us_i = static_cast<unsigned>(clocks_);
        if (m.active_o != active_) {
            // The gate was reset while no clock ran: what the DSP has is all it gets.
            // A cut frame of the pattern has no flag but that the switch was forced.
            receiver_.source_changes(m.cut_o | static_cast<unsigned>(m.forced_o) << kPattern, now_);
            active_ = m.active_o;
        }
        if (m.active_o == kPattern && (m.cut_o & ~cut_))
            fail("a camera's frame cut while the pattern runs", now_);
        for (int i = 0; i < 2; ++i)
            cuts += (m.cut_o & ~cut_) >> i & 1;
        cut_ = m.cut_o;
    }

    void watch_clock(bool line, bool sync, int data) {
        auto &m = *model_;
        if (m.ppi_clock_o == clock_)
            return;
        if (!checking_) {
            clock_ = m.ppi_clock_o;
            clock_changed_ = now_ - 1'000'000;
            return;
        }
        const Picoseconds width = now_ - clock_changed_;
        if (clock_) {
            shortest_high = std::min(shortest_high, width);
        } else {
            shortest_low = std::min(shortest_low, width);
            receiver_.sample(line, sync, data, m.active_o, now_);
        }
        if (width < kPixelHalf * 99 / 100)
            fail(clock_ ? "runt high phase" : "runt low phase", now_);
        clock_ = m.ppi_clock_o;
        clock_changed_ = now_;
    }

    const Mode &mode_;
    std::mt19937_64 &random_;
    Camera left_, right_;
    std::array<Camera *, 2> cameras_;
    Receiver receiver_;
    std::unique_ptr<Vvideo_path> model_ = std::make_unique<Vvideo_path>();
    bool checking_ = false;  // since the reset
    Picoseconds now_ = 0, next_control_ = kControlHalf, clock_changed_ = -1'000'000, began_ = -1;
    std::int64_t clocks_ = 0;
    bool clock_ = false;
    unsigned active_ = 0, cut_ = 0;
};

/** One run of random switches in one mode. */
void run(const Mode &mode, int switches, std::mt19937_64 &random, const char *name) {
    Bench bench(mode, random);
    for (int i = 0; i < switches; ++i) {
        bench.request(static_cast<int>(random() % 3));
        Picoseconds pause = static_cast<Picoseconds>(random() % 60'000'000);
        if (random() % 4 == 0)
            pause = static_cast<Picoseconds>(random() % 1'000'000);
        bench.run_for(pause);
        if (random() % 16 == 0) {
            bench.model().stream_i = 0;
            bench.run_for(static_cast<Picoseconds>(random() % 40'000'000));
            bench.model().stream_i = 1;
        }
    }
    for (int i = 0; i < 2; ++i)
        bench.camera(i).heal(bench.now());
    bench.run_for(300'000'000);
    auto &m = bench.model();
    auto &r = bench.receiver();
    for (int source = 0; source < 3 && !mode.alternating; ++source) {
        bench.request(source);
        const int before = r.from[static_cast<std::size_t>(source)];
        bench.run_for(mode.long_frames ? 900'000'000 : 250'000'000);
        if (m.active_o != source || !m.gate_open_o ||
            r.from[static_cast<std::size_t>(source)] < before + 2) {
            fail("a healthy source does not come back", bench.now());
        }
    }
    if (!mode.faults && !mode.long_frames && r.torn + bench.cuts + bench.timed_out + bench.lost > 0)
        fail("trouble without a fault", bench.now());
    if (mode.alternating && std::min(r.from[0], r.from[1]) < 10)
        fail("cameras do not alternate", bench.now());
    const unsigned frames[2] = {m.camera0_frames_o, m.camera1_frames_o};
    const unsigned short_lines[2] = {m.camera0_short_lines_o, m.camera1_short_lines_o};
    const unsigned short_frames[2] = {m.camera0_short_frames_o, m.camera1_short_frames_o};
    for (int i = 0; i < 2; ++i) {
        const auto &camera = bench.camera(i);
        const int late = camera.frames_sent() - static_cast<int>(frames[i]);
        // The frame during reset may be missed; the last one may still be under way through the
        // registers.
        if (late < 0 || late > 2)
            fail("frames counted wrongly", bench.now());
        const int wrong = std::min(camera.wrong_lines(), 255),
                  high = std::min(camera.wrong_frames(), 255);
        if (static_cast<int>(short_lines[i]) > wrong ||
            static_cast<int>(short_lines[i]) < wrong - 2)
            fail("wrong lines miscounted", bench.now());
        if (static_cast<int>(short_frames[i]) > high ||
            static_cast<int>(short_frames[i]) < high - 2)
            fail("wrong frames miscounted", bench.now());
    }
    std::printf(
        "%-28s %5d switched %4d timed out %4d lost | frames %6d (%d left, %d right, %d pattern) "
        "torn %d cut %d | "
        "shortest high %.2f low %.2f ns | longest switch %.0f us\n",
        name, bench.switched, bench.timed_out, bench.lost, r.whole, r.from[0], r.from[1], r.from[2],
        r.torn, bench.cuts, static_cast<double>(bench.shortest_high) * 1e-3,
        static_cast<double>(bench.shortest_low) * 1e-3,
        static_cast<double>(bench.longest_switch) * 1e-6);
}

}  // namespace

int main(int argc, char **argv) {
    Verilated::commandArgs(argc, argv);
    const int switches = argc > 1 ? std::atoi(argv[1]) : 200;
    const std::uint64_t seed =
        argc > 2 ? std::strtoull(argv[2], nullptr, 0) : std::random_device{}();
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    Verilated::randReset(2);
    Verilated::randSeed(static_cast<int>(seed & 0x7FFFFFFF));
    std::mt19937_64 random(seed);
    const Mode plain{false, false, false, {false, false}, false, false, false, 40, 12, 9, 60};
    run(plain, switches, random, "healthy");
    Mode mode = plain;
    mode.falling = {true, false};
    mode.tag = true;
    run(mode, switches, random, "healthy, edges, tag");
    mode = plain;
    mode.wrong_sizes = true;
    run(mode, switches, random, "wrong sizes");
    mode = plain;
    mode.faults = true;
    run(mode, switches, random, "stopping clocks");
    mode.first_line_sync = true;
    mode.falling = {false, true};
    run(mode, switches, random, "stopping clocks, first line");
    mode.tag = true;
    mode.line_blanking = 1;
    mode.frame_blanking = 12;
    run(mode, switches, random, "stopping, little blanking");
    mode = plain;
    mode.alternating = true;
    run(mode, switches / 4, random, "alternating");
    mode.faults = true;
    run(mode, switches, random, "alternating, stopping");
    mode = plain;
    mode.long_frames = true;
    mode.height = 90;
    run(mode, switches, random, "frames above the time-out");
    mode.faults = true;
    run(mode, switches, random, "the same, stopping");
    std::printf("%s\n", failures == 0 ? "passed" : "FAILED");
    return failures == 0 ? 0 : 1;
}
