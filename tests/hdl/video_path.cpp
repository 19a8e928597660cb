// SPDX-License-Identifier: Apache-2.0
//
// The pixel path alone (fpga/rtl/video_path.v): two cameras whose clocks drift, stop high or low in
// the middle of anything and come back at any moment, and requests to switch at any moment. Every
// frame that the DSP receives must be one that a source sent, bit for bit, or be flagged as cut; no
// phase of the PPI clock may be shorter than that phase of a source.
//
//   video_path [switches [seed]]
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

namespace {

using Picoseconds = std::int64_t;

constexpr Picoseconds kControlHalf = 20000;  // 25 MHz
constexpr Picoseconds kPixelHalf = 10417;    // 48 MHz
constexpr Picoseconds kOutputDelay = 3900;   // of the sensor's data after its clock
constexpr int kPattern = 2;

int failures = 0;

void fail(const char *what, Picoseconds when) {
    if (++failures <= 20)
        std::printf("FAIL %s at %.3f us\n", what, static_cast<double>(when) * 1e-6);
}

/** One mode of operation: what stays the same during a run. */
struct Mode {
    bool first_line_sync;
    bool tag;
    bool alternating;
    std::array<bool, 2> falling;
    bool faults;       // clocks stop
    bool wrong_sizes;  // now and then a line or frame of another size
    int width, height, line_blanking, frame_blanking;
};

/** The pixel at column x, row y of a frame of a camera; pixel 1 tells camera and frame. */
int pixel_of(int camera, int frame, int x, int y) {
    if (x == 1)
        return camera << 9 | (frame & 511);
    std::uint32_t h = static_cast<std::uint32_t>(frame) * 2654435761u ^
                      static_cast<std::uint32_t>(x) * 40503u ^
                      static_cast<std::uint32_t>(y) * 2246822519u ^
                      static_cast<std::uint32_t>(camera + 1) * 3266489917u;
    h ^= h >> 15;
    h *= 2246822519u;
    return static_cast<int>(h >> 20 & 1023);
}

/** A sensor and its clock. */
class Camera {
  public:
    Camera(int number, const Mode &mode, std::mt19937_64 &random)
        : number_(number), mode_(mode), random_(random) {
        next_edge_ = static_cast<Picoseconds>(random_() % 20000) + 1;
        half_ = kPixelHalf;
        plan_fault(1'000'000);
        blank_ = 60;
    }

    Picoseconds next_event() const { return std::min(next_edge_, next_data_); }

    /** Does what is due at `now`. */
    void advance(Picoseconds now) {
        if (now == next_data_) {
            data = waiting_data_;
            line = waiting_line_;
            frame = waiting_frame_;
            next_data_ = kNever;
        }
        if (now != next_edge_)
            return;
        clock = !clock;
        // Data change at the edge at which the bridge does not sample.
        if (clock == mode_.falling[static_cast<std::size_t>(number_)]) {
            produce();
            next_data_ = now + kOutputDelay;
        }
        half_ += static_cast<Picoseconds>(random_() % 5) - 2;  // drift
        half_ = std::clamp<Picoseconds>(half_, kPixelHalf * 99 / 100, kPixelHalf * 101 / 100);
        next_edge_ = now + half_;
        if (mode_.faults && healthy_after_ < 0 && now >= fault_at_) {
            next_edge_ += fault_length_;
            plan_fault(next_edge_);
        }
    }

    /** No further faults from now on; a stopped clock comes back. */
    void heal(Picoseconds now) {
        healthy_after_ = now;
        next_edge_ = std::min(next_edge_, now + 3 * kPixelHalf);
    }

    int frames_sent() const { return frames_done_; }
    int wrong_lines() const { return wrong_lines_; }
    int wrong_frames() const { return wrong_frames_; }
    /** Size of a frame by its number's low nine bits. */
    const std::vector<int> &lines_of(int frame) const {
        return sizes_[static_cast<std::size_t>(frame & 511)];
    }

    bool clock = false;
    int data = 0;
    bool line = false;
    bool frame = false;

  private:
    static constexpr Picoseconds kNever = INT64_MAX;

    void plan_fault(Picoseconds from) {
        fault_at_ = from + static_cast<Picoseconds>(random_() % 60'000'000);
        switch (random_() % 4) {
            case 0:
                fault_length_ = static_cast<Picoseconds>(random_() % 400'000);
                break;
            case 1:
                fault_length_ = 5'900'000 + static_cast<Picoseconds>(random_() % 4'000'000);
                break;  // just lost
            case 2:
                fault_length_ = static_cast<Picoseconds>(random_() % 12'000'000);
                break;
            default:
                fault_length_ = static_cast<Picoseconds>(random_() % 200'000'000);
                break;
        }
    }

    void begin_frame() {
        int height = mode_.height;
        if (mode_.wrong_sizes && random_() % 8 == 0)
            height = 1 + static_cast<int>(random_() % 20);
        auto &lines = sizes_[static_cast<std::size_t>(frame_number_ & 511)];
        lines.assign(static_cast<std::size_t>(height), mode_.width);
        if (mode_.wrong_sizes && random_() % 4 == 0) {
            lines[random_() % lines.size()] = 4 + static_cast<int>(random_() % 60);
        }
        y_ = 0;
        x_ = -(2 + static_cast<int>(random_() % 6));
        blank_ = 0;
    }

    /** The pins' next values. */
    void produce() {
        if (blank_ > 0) {
            --blank_;
            waiting_frame_ = waiting_line_ = false;
            waiting_data_ = static_cast<int>(random_() & 1023);
            if (blank_ == 0)
                begin_frame();
            return;
        }
        const auto &lines = sizes_[static_cast<std::size_t>(frame_number_ & 511)];
        waiting_frame_ = true;
        waiting_line_ = x_ >= 0;
        waiting_data_ =
            x_ >= 0 ? pixel_of(number_, frame_number_, x_, y_) : static_cast<int>(random_() & 1023);
        ++x_;
        if (x_ < lines[static_cast<std::size_t>(y_)])
            return;
        if (lines[static_cast<std::size_t>(y_)] != mode_.width)
            ++wrong_lines_;
        x_ = -mode_.line_blanking;
        ++y_;
        if (y_ < static_cast<int>(lines.size()))
            return;
        if (static_cast<int>(lines.size()) != mode_.height)
            ++wrong_frames_;
        blank_ = mode_.frame_blanking;
        ++frame_number_;
        ++frames_done_;
    }

    int number_;
    const Mode &mode_;
    std::mt19937_64 &random_;
    Picoseconds next_edge_ = 0, next_data_ = kNever, half_ = kPixelHalf;
    Picoseconds fault_at_ = 0, fault_length_ = 0, healthy_after_ = -1;
    int waiting_data_ = 0;
    bool waiting_line_ = false, waiting_frame_ = false;
    int x_ = 0, y_ = 0, blank_ = 0, frame_number_ = 0, frames_done_ = 0, wrong_lines_ = 0,
        wrong_frames_ = 0;
    std::array<std::vector<int>, 512> sizes_;
};

/** What the DSP sees at the rising edges of the PPI clock. */
class Receiver {
  public:
    Receiver(const Mode &mode, const std::array<Camera *, 2> &cameras)
        : mode_(mode), cameras_(cameras) {}

    void sample(bool line, bool sync, int data, int source, Picoseconds now) {
        if (mode_.first_line_sync ? sync && !sync_ : sync != sync_) {
            if (inside_)
                finish(now);
            if (sync) {
                inside_ = true;
                source_ = source;
                lines_.clear();
            }
        }
        sync_ = sync;
        if (!mode_.first_line_sync && line && !sync)
            fail("line outside a frame", now);
        if (line && !inside_)
            fail("line outside a frame", now);
        if (line && !line_)
            lines_.emplace_back();
        if (line)
            lines_.back().push_back(data);
        line_ = line;
    }

    /** A forced switch may end a frame without a further clock. */
    void source_changes(Picoseconds now) {
        if (inside_)
            finish(now);
        sync_ = line_ = false;
    }

    int whole = 0, torn = 0;
    std::array<int, 3> from{};

  private:
    void finish(Picoseconds now) {
        inside_ = false;
        if (lines_.empty()) {
            ++torn;
            return;
        }
        (source_ == kPattern ? whole_pattern(now) : whole_camera(now)) ? ++whole : ++torn;
        ++from[static_cast<std::size_t>(source_)];
    }

    bool tag_right(Picoseconds now) {
        if (!mode_.tag)
            return true;
        const int tag = lines_[0][0];
        if (tag >> 8 != source_)
            fail("wrong source in the tag", now);
        if (number_ >= 0 && (tag & 255) != ((number_ + 1) & 255))
            fail("wrong number in the tag", now);
        number_ = tag & 255;
        return true;
    }

    bool whole_camera(Picoseconds now) {
        tag_right(now);
        if (lines_[0].size() < 2)
            return false;
        const int id = lines_[0][1];
        if (id >> 9 != source_)
            fail("frame of the other camera", now);
        const int frame = id & 511;
        const auto &sizes = cameras_[static_cast<std::size_t>(source_)]->lines_of(frame);
        if (lines_.size() != sizes.size())
            return false;
        for (std::size_t y = 0; y < sizes.size(); ++y) {
            if (static_cast<int>(lines_[y].size()) != sizes[y])
                return false;
            for (std::size_t x = 0; x < lines_[y].size(); ++x) {
                if (mode_.tag && x == 0 && y == 0)
                    continue;
                if (lines_[y][x] != recover(frame, static_cast<int>(x), static_cast<int>(y)))
                    return false;
            }
        }
        return true;
    }

    /** Frames are numbered above nine bits only inside the camera: try the last few. */
    int recover(int frame, int x, int y) {
        const int sent = cameras_[static_cast<std::size_t>(source_)]->frames_sent();
        const int number = sent - ((sent - frame) & 511);
        return pixel_of(source_, number, x, y);
    }

    bool whole_pattern(Picoseconds now) {
        tag_right(now);
        if (static_cast<int>(lines_.size()) != mode_.height)
            return false;
        int value = mode_.tag ? (lines_[0][1] + 1023) & 1023 : lines_[0][0];
        for (std::size_t y = 0; y < lines_.size(); ++y) {
            if (static_cast<int>(lines_[y].size()) != mode_.width)
                return false;
            for (std::size_t x = 0; x < lines_[y].size(); ++x, ++value) {
                if (mode_.tag && x == 0 && y == 0)
                    continue;
                if (lines_[y][x] != (value & 1023))
                    return false;
            }
            ++value;
        }
        return true;
    }

    const Mode &mode_;
    const std::array<Camera *, 2> &cameras_;
    std::vector<std::vector<int>> lines_;
    bool inside_ = false, sync_ = false, line_ = false;
    int source_ = 0, number_ = -1;
};

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
        m.timeout_ms_i = 3;
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
        m.rst_i = 0;
        m.clk_i = m.camera0_clk_i = m.camera1_clk_i = 0;
        m.eval();
        m.rst_i = 1;  // a reset is an edge to the simulator
        m.eval();
        clock_ = m.ppi_clock_o;
        for (int i = 0; i < 8; ++i)
            step();
        m.rst_i = 0;
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
            receiver_.source_changes(now_);
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
        bench.run_for(250'000'000);
        if (m.active_o != source || !m.gate_open_o ||
            r.from[static_cast<std::size_t>(source)] < before + 2) {
            fail("a healthy source does not come back", bench.now());
        }
    }
    if (r.torn > bench.cuts)
        fail("torn frames without a flag", bench.now());
    if (!mode.faults && r.torn + bench.cuts + bench.timed_out + bench.lost > 0)
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
    const Mode plain{false, false, false, {false, false}, false, false, 40, 12, 9, 60};
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
    std::printf("%s\n", failures == 0 ? "passed" : "FAILED");
    return failures == 0 ? 0 : 1;
}
