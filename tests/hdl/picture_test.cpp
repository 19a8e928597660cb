// SPDX-License-Identifier: Apache-2.0
// PPI output besides whole frames of one camera: each kind of test picture pixel by pixel, tags,
// the other form of frame sync, the other sampling edge, alternating cameras.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "bench/bus_bench.hpp"
#include "bench/pixel_source.hpp"
#include "bench/servo_checker.hpp"

namespace {

using hdl::kMs;
using hdl::kUs;

constexpr uint8_t kCtrl = 0x08, kIrqStatus = 0x0A, kCamSelect = 0x20, kCamState = 0x21,
                  kPpiMode = 0x23;
constexpr uint8_t kPatternWidth = 0x24, kPatternKind = 0x28, kPatternSeed = 0x29;
constexpr uint16_t kStream = 0x0100, kPattern = 2, kTag = 0x0100;
enum Kind { kRamp, kChecker, kPrbs, kWalking, kConstant };

// The pins at each rising edge of the PPI clock.
class PpiPins : public hdl::Listener {
  public:
    struct Sample {
        uint64_t time_ps;
        bool line, frame;
        uint16_t data;
    };
    uint32_t wanted() const override { return BRIDGE_EVENT_PPI_CLK; }
    void on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) override {
        if (now.ppi_clk != 0) {
            samples.push_back({time_ps, now.ppi_fs1 != 0, now.ppi_fs2 != 0, now.ppi_data});
        }
    }
    std::vector<Sample> samples;
};

struct Bench : hdl::BusBench {
    hdl::PpiReceiver ppi;

    Bench() : ppi(bridge) {}

    void pattern_size(const hdl::Window &window) {
        REQUIRE(master.write(hdl::Registers::kAddress,
                             {kPatternWidth, uint8_t(window.width >> 8), uint8_t(window.width),
                              uint8_t(window.height >> 8), uint8_t(window.height),
                              uint8_t(window.hblank >> 8), uint8_t(window.hblank), 0,
                              uint8_t(window.vblank)}) == 10);
    }
    // Starts from a reset: the rows of the blanking are counted from there, and a row number
    // already passed would only come again after 4096 rows.
    void pattern(unsigned kind, unsigned seed, const hdl::Window &window) {
        bridge.reset();
        write(kPatternKind, kind);
        write(kPatternSeed, seed);
        pattern_size(window);
        write(kCamSelect, kPattern);
        // Through the blanking, and long enough for a picture that should not run yet.
        const uint64_t row = uint64_t(window.width + window.hblank) * kUs;
        bridge.run_idle(window.vblank < 8 ? 4096 * row : 3 * (window.height + window.vblank) * row);
        ppi.forget();
        write(kCtrl, kStream);
    }
    // Runs until this many frames are complete.
    void wait_frames(size_t count, uint64_t longest_ps) {
        const uint64_t end = bridge.now() + longest_ps;
        while (bridge.now() < end &&
               (ppi.frames.size() < count || ppi.frames[count - 1].end_ps == 0)) {
            bridge.run(20 * kUs);
        }
        REQUIRE(ppi.frames.size() >= count);
        REQUIRE(ppi.frames[count - 1].end_ps != 0);
    }
};

// The pixels of one frame as documented in the register map; base: of the ramp's first pixel.
std::vector<std::vector<uint16_t>> pattern_of(unsigned kind, unsigned seed,
                                              const hdl::Window &window, unsigned base) {
    std::vector<std::vector<uint16_t>> lines(window.height);
    unsigned shift = seed | 1u;
    for (unsigned y = 0; y < window.height; y++) {
        for (unsigned x = 0; x < window.width; x++) {
            unsigned value = 0;
            switch (kind) {
                case kRamp:
                    value = base + x + y * (window.width + 1);
                    break;
                case kChecker:
                    value = ((x / 16 + y / 16) & 1u) != 0 ? 1023 : 0;
                    break;
                case kPrbs:
                    value = shift;
                    shift = shift << 1 | ((shift >> 9 ^ shift >> 6) & 1u);
                    break;
                case kWalking:
                    value = 1u << (x + y * window.width) % 10;
                    break;
                default:
                    value = seed;
            }
            lines[y].push_back(uint16_t(value & 0x3FFu));
            shift &= 0x3FFu;
        }
    }
    return lines;
}

// Three frames in a row: their pixels, sizes and times. hblank as rounded by the registers.
void check_pattern(Bench &bench, unsigned kind, unsigned seed, const hdl::Window &window) {
    INFO("kind " << kind << " seed " << seed << " " << window.width << " x " << window.height);
    bench.pattern(kind, seed, window);
    const uint64_t row_ps = (window.width + window.hblank) * uint64_t(BRIDGE_CONTROL_PERIOD_PS);
    const uint64_t frame_ps = row_ps * (window.height + window.vblank);
    bench.wait_frames(3, 4 * frame_ps + 100 * kUs);
    const unsigned step = window.height * (window.width + 1);
    const unsigned base = kind == kRamp ? bench.ppi.frames[0].lines[0][0] : 0u;
    if (kind == kRamp) {
        // Frames are counted from the first one, which may have passed before the gate opened.
        CHECK((base == 0 || base == (step & 0x3FFu)));
    }
    for (unsigned i = 0; i < 3; i++) {
        const hdl::Received &frame = bench.ppi.frames[i];
        CHECK((frame.lines == pattern_of(kind, seed, window, base + i * step)));
        CHECK(frame.end_ps - frame.begin_ps == row_ps * window.height);
        if (i > 0) {
            CHECK(frame.begin_ps - bench.ppi.frames[i - 1].begin_ps == frame_ps);
        }
    }
}

hdl::Window size(unsigned width, unsigned height, unsigned hblank, unsigned vblank) {
    hdl::Window window;
    window.width = width;
    window.height = height;
    window.hblank = hblank;
    window.vblank = vblank;
    return window;
}

// Cameras with small, fast frames, and slightly different clocks.
struct Cameras : Bench {
    hdl::Window window;
    hdl::PixelSource left, right;

    static hdl::Window small() {
        hdl::Window window = size(16, 4, 0, 2);
        window.fixed = 40;
        return window;
    }
    static hdl::Window small_pattern() { return size(16, 8, 8, 255); }
    // The pattern's blanking lasts longer than all of this, so its numbers are set in time.
    explicit Cameras(bool launch_at_fall = false)
        : window(small()), left(bridge, 0, window), right(bridge, 1, window) {
        pattern_size(small_pattern());
        left.launch_at_fall = right.launch_at_fall = launch_at_fall;
        write(0x48, 0x00F3);
        write(kPpiMode, launch_at_fall ? 0 : 0x0030);
        left.set_period(20833);
        right.set_period(20911);
    }
    uint64_t frame_ps() const { return window.frame_clocks() * 20911; }
    // Cameras of the received frames; -1 for a wrong one.
    std::vector<int> sources() const {
        std::vector<int> cameras;
        for (const hdl::Received &frame : ppi.frames) {
            int camera = -1;
            uint32_t number = 0;
            if (frame.end_ps != 0) {
                const std::string fault = hdl::check_frame(frame, window, camera, number);
                INFO(fault);
                CHECK(fault.empty());
                cameras.push_back(fault.empty() ? camera : -1);
            }
        }
        return cameras;
    }
};

}  // namespace

TEST_CASE("each kind of test picture, pixel by pixel") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Random random(seed);
    Bench bench;
    for (unsigned kind = kRamp; kind <= kConstant; kind++) {
        for (int i = 0; i < 3; i++) {
            check_pattern(bench, kind, random.below(1024),
                          size(16 * (1 + random.below(4)), 8 * (1 + random.below(5)),
                               8 + 4 * random.below(8), 8 + random.below(4)));
        }
    }
    check_pattern(bench, kConstant, 0x2AA, size(16, 8, 8, 1));
    check_pattern(bench, kConstant, 0x155, size(16, 8, 8, 1));
}

TEST_CASE("the largest test pictures") {
    Bench bench;
    check_pattern(bench, kRamp, 0, size(4080, 8, 1020, 8));
    check_pattern(bench, kChecker, 0, size(16, 4088, 8, 255));
}

TEST_CASE("a test picture stops and starts with whole frames only") {
    Bench bench;
    const hdl::Window window = size(16, 8, 8, 8);
    bench.pattern(kWalking, 0, window);
    bench.wait_frames(2, kMs);
    for (int i = 0; i < 20; i++) {
        bench.write(kCtrl, i % 2 == 0 ? 0 : kStream);
        bench.bridge.run(uint64_t(7 * i + 3) * kUs);
    }
    bench.write(kCtrl, 0);
    bench.bridge.run(kMs);
    const size_t frames = bench.ppi.frames.size();
    bench.bridge.run(kMs);
    CHECK(bench.ppi.frames.size() == frames);
    for (const hdl::Received &frame : bench.ppi.frames) {
        CHECK((frame.lines == pattern_of(kWalking, 0, window, 0)));
    }
    CHECK(bench.ppi.broken == 0);
}

TEST_CASE("tags: source and number of each frame since reset, in its first pixel alone") {
    Cameras bench;
    bench.write(kPpiMode, 0x0030 | kTag);
    unsigned passed = 0;
    for (const unsigned source : {0u, 1u, 2u, 0u}) {
        bench.ppi.forget();
        const hdl::Window window = source == kPattern ? Cameras::small_pattern() : bench.window;
        bench.write(kCamSelect, source);
        bench.write(kPatternKind, kConstant);
        bench.write(kPatternSeed, 0x3C5);
        bench.write(kCtrl, kStream);
        bench.wait_frames(source == 1 ? 260 : 3, 5 * kMs);
        // Lets the last frame end.
        bench.write(kCtrl, 0);
        bench.bridge.run(source == kPattern ? kMs : 3 * bench.frame_ps());
        for (const hdl::Received &frame : bench.ppi.frames) {
            CAPTURE(source);
            CAPTURE(passed);
            CHECK(frame.lines.size() == window.height);
            CHECK(frame.lines[0][0] == (source << 8 | (passed & 0xFFu)));
            passed++;
            // The tag covers the upper bits of the camera's own number.
            const hdl::PixelSource &camera = source == 1 ? bench.right : bench.left;
            const uint32_t low = frame.lines[0][1];
            const uint32_t number = camera.frames() - ((camera.frames() - low) & 0x3FFu);
            unsigned wrong = 0;
            for (unsigned y = 0; y < window.height; y++) {
                for (unsigned x = y == 0; x < window.width; x++) {
                    wrong +=
                        frame.lines[y][x] !=
                        (source == kPattern ? 0x3C5 : hdl::pixel_of(int(source), number, x, y));
                }
            }
            CHECK(wrong == 0);
        }
    }
    // The mode is latched between frames: without it the pixels are the sensor's again.
    bench.write(kPpiMode, 0x0030);
    bench.ppi.forget();
    bench.write(kCtrl, kStream);
    bench.wait_frames(3, kMs);
    CHECK(bench.sources()[0] == 0);
}

TEST_CASE("frame sync as a pulse during the first line") {
    Cameras bench;
    PpiPins pins;
    bench.bridge.add(pins);
    bench.write(kPpiMode, 0x0031);
    bench.write(kCtrl, kStream);
    bench.bridge.run(6 * bench.frame_ps());
    bench.write(kCtrl, 0);
    bench.bridge.run(2 * bench.frame_ps());
    unsigned lines = 0, syncs = 0, wrong = 0, width = 0;
    bool before = false;
    for (const PpiPins::Sample &sample : pins.samples) {
        const bool begins = sample.line && !before;
        width = begins ? 0 : width;
        width += sample.line;
        lines += begins;
        syncs += begins && sample.frame;
        // The sync lasts exactly as long as the first of each frame's lines.
        wrong += sample.frame != (sample.line && (lines - 1) % bench.window.height == 0);
        wrong += !sample.line && before && width != bench.window.width;
        before = sample.line;
    }
    CHECK(wrong == 0);
    CHECK(syncs >= 4);
    CHECK(lines == syncs * bench.window.height);
}

TEST_CASE("pixels are taken at the edge that is asked for, and only there") {
    for (const bool launch_at_fall : {true, false}) {
        CAPTURE(launch_at_fall);
        Cameras bench(launch_at_fall);
        bench.left.only_at_edge = bench.right.only_at_edge = true;
        for (const unsigned source : {0u, 1u}) {
            bench.write(kCamSelect, source);
            bench.write(kCtrl, kStream);
            bench.bridge.run(5 * bench.frame_ps());
            bench.write(kCtrl, 0);
            bench.bridge.run(2 * bench.frame_ps());
            const auto cameras = bench.sources();
            CHECK(cameras.size() >= 3);
            CHECK(cameras == std::vector<int>(cameras.size(), int(source)));
            bench.ppi.forget();
        }
    }
}

TEST_CASE("alternating cameras: so many frames of each, and none of a camera that is lost") {
    Cameras bench;
    bench.write(kCtrl, kStream);
    for (const unsigned each : {0u, 1u, 2u, 5u, 127u}) {
        CAPTURE(each);
        bench.write(kCamSelect, 0x0100 | each << 9);
        bench.bridge.run(4 * bench.frame_ps());
        bench.ppi.forget();
        bench.bridge.run((5 * std::max(each, 1u) / 2 + 24) * bench.frame_ps());
        // Runs of one camera; the first and the last are incomplete.
        std::vector<unsigned> runs;
        int before = -1;
        for (const int camera : bench.sources()) {
            if (camera != before) {
                runs.push_back(0);
            }
            runs.back()++;
            before = camera;
        }
        REQUIRE(runs.size() >= 3);
        for (size_t i = 1; i + 1 < runs.size(); i++) {
            CHECK(runs[i] == std::max(each, 1u));
        }
    }
    bench.write(kCamSelect, 0x0300);
    for (const int dead : {1, 0}) {
        hdl::PixelSource &source = dead == 0 ? bench.left : bench.right;
        source.set_period(0);
        bench.bridge.run(kMs);
        bench.ppi.forget();
        bench.bridge.run(8 * bench.frame_ps());
        const auto cameras = bench.sources();
        CHECK(cameras.size() >= 6);
        CHECK(cameras == std::vector<int>(cameras.size(), 1 - dead));
        CHECK((bench.read(kCamState) & 0x33) == unsigned(0x11 - dead));
        source.set_period(20833);
        bench.bridge.run(4 * bench.frame_ps());
    }
    // From the pattern, alternating begins with the left camera.
    bench.write(kCamSelect, kPattern);
    bench.bridge.run(3 * kMs);
    CHECK((bench.read(kCamState) & 3) == kPattern);
    bench.ppi.forget();
    bench.write(kCamSelect, 0x0300);
    bench.bridge.run(kMs);
    bench.ppi.forget();
    bench.bridge.run(10 * bench.frame_ps());
    const auto cameras = bench.sources();
    CHECK(std::count(cameras.begin(), cameras.end(), 0) >= 2);
    CHECK(std::count(cameras.begin(), cameras.end(), 1) >= 2);
}

TEST_CASE("a frame that does not end is cut at a switch after its time-out, and reported") {
    for (unsigned camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        Cameras bench;
        hdl::PixelSource &source = camera == 0 ? bench.left : bench.right;
        const auto flags = uint8_t(camera == 0 ? 0x37 : 0x3F);
        const uint16_t cut = 0x10, forced = 0x40, timed_out = 0x04;
        bench.write(0x22, 2);
        bench.write(kCamSelect, camera);
        bench.write(kCtrl, kStream);
        bench.bridge.run(4 * bench.frame_ps());
        bench.write(kIrqStatus, 0xFF);
        // Some milliseconds long.
        hdl::Window window = bench.window;
        window.height = 5000;
        source.set_window(window);
        bench.bridge.run(2 * bench.frame_ps());
        source.set_window(bench.window);
        bench.ppi.forget();
        bench.write(kCamSelect, 1 - camera);
        bench.bridge.run(kMs / 2);
        CHECK((bench.read(kCamState) & 0x33) == (0x30 | camera));
        CHECK((bench.read(kIrqStatus) & timed_out) == 0);
        bench.bridge.run(3 * kMs);
        CHECK((bench.read(kCamState) & 0x73) == (forced | 0x10 | (1 - camera)));
        CHECK((bench.read(kIrqStatus) & timed_out) != 0);
        CHECK((bench.read(flags) & cut) != 0);
        // The cut frame, and whole frames of the other camera.
        REQUIRE(bench.ppi.frames.size() > 3);
        CHECK(bench.ppi.frames[0].lines.size() > 1000);
        CHECK(bench.ppi.frames[0].lines.size() < 5000);
        bench.ppi.frames.erase(bench.ppi.frames.begin());
        const auto others = bench.sources();
        CHECK(others == std::vector<int>(others.size(), int(1 - camera)));
        // Until the next frame of it.
        bench.bridge.run(5 * kMs);
        bench.write(kCamSelect, camera);
        bench.bridge.run(5 * bench.frame_ps());
        CHECK((bench.read(kCamState) & 0x73) == (0x10 | camera));
        CHECK((bench.read(flags) & cut) == 0);
        CHECK(bench.ppi.broken == 0);
    }
}
