// SPDX-License-Identifier: Apache-2.0
// Measurements of each camera: sizes, counts, clock and period, times of frames; reports of wrong
// lines and frames; one transfer shows one frame; saturation of each number.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "bench/bus_bench.hpp"
#include "bench/pixel_source.hpp"

namespace {

using hdl::kMs;
using hdl::kNs;
using hdl::kUs;

constexpr uint8_t kCtrl = 0x08, kIrqStatus = 0x0A, kPpiMode = 0x23, kExpectWidth = 0x2A;
constexpr uint8_t kExpectHeight = 0x2B, kSensor = 0x48, kTime = 0x4A, kSkew = 0x44;
constexpr uint8_t kFrameTime = 0x45, kCameras[] = {0x30, 0x38};
constexpr uint16_t kLineError = 0x40, kFrameStart = 0x01, kClockLost = 0x08;
// Of a camera's block.
enum Word { kFrames, kLines, kPixels, kPeriod, kPixclk, kShortLines, kShortFrames, kFlags };
constexpr uint16_t kShortLine = 4, kShortFrame = 8, kLost = 1;
constexpr unsigned kMax = 3840;  // largest count of lines and pixels

struct Bench : hdl::BusBench {
    Bench() {
        write(kSensor, 0x00F3);
        write(kPpiMode, 0x0030);
    }
    std::vector<uint16_t> block(int camera) {
        const auto words = registers.read(kCameras[camera], 8);
        REQUIRE(words);
        return *words;
    }
    uint32_t time_us() {
        const auto words = registers.read(kTime, 2);
        REQUIRE(words);
        return uint32_t((*words)[0]) << 16 | (*words)[1];
    }
    // The first words of a block with a pause after the first one.
    template <typename Pause>
    std::vector<uint16_t> read_slowly(uint8_t index, unsigned words, Pause pause) {
        REQUIRE(master.write(hdl::Registers::kAddress, {index}, false) == 2);
        master.start();
        REQUIRE(master.write_byte(hdl::Registers::kAddress << 1 | 1));
        std::vector<uint16_t> values;
        for (unsigned i = 0; i < words; i++) {
            const unsigned high = master.read_byte(true);
            values.push_back(uint16_t(high << 8 | master.read_byte(i + 1 < words)));
            if (i == 0) {
                pause();
            }
        }
        master.stop();
        return values;
    }
};

hdl::Window small() {
    hdl::Window window;
    window.width = 16;
    window.height = 4;
    window.hblank = 0;
    window.vblank = 2;
    window.fixed = 40;
    return window;
}

// A camera and its picture.
struct OneCamera : Bench {
    hdl::Window window = small();
    int camera;
    hdl::PixelSource source;
    uint32_t period_ps = 20833;

    explicit OneCamera(int number) : camera(number), source(bridge, number, window) {
        source.set_period(period_ps);
    }
    uint64_t frame_ps() const { return source.window().frame_clocks() * period_ps; }
    void frames(unsigned count) { bridge.run(count * frame_ps()); }
    // To the end of the next frame; then the clock is stopped, as a transfer takes longer.
    void next_frame() {
        source.set_period(period_ps);
        const uint32_t number = source.frames();
        while (source.frames() == number || bridge.in.frame_valid[camera] == 0) {
            bridge.run(kUs / 4);
        }
        while (bridge.in.frame_valid[camera] != 0) {
            bridge.run(kUs / 4);
        }
        bridge.run(kUs);
        source.set_period(0);
    }
};

// A camera whose frame valid and line valid the test controls; its clock runs.
void frame_at(hdl::Bridge &bridge, int camera, uint64_t begin_ps, uint64_t length_ps) {
    bridge.at(begin_ps, [&bridge, camera] {
        bridge.in.frame_valid[camera] = 1;
        bridge.drive();
    });
    bridge.at(begin_ps + length_ps, [&bridge, camera] {
        bridge.in.frame_valid[camera] = 0;
        bridge.drive();
    });
}

}  // namespace

TEST_CASE("size and count of frames; wrong lines and frames, with nothing expected") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        OneCamera bench(camera);
        uint32_t frames = 0;
        const auto next = [&](unsigned lines, unsigned short_lines, unsigned short_frames,
                              unsigned flags) {
            bench.next_frame();
            const auto words = bench.block(camera);
            frames = frames == 0 ? words[kFrames] : frames + 1;
            CHECK(words[kFrames] == frames);
            CHECK(words[kLines] == lines);
            CHECK(words[kPixels] == 16);
            CHECK(words[kShortLines] == short_lines);
            CHECK(words[kShortFrames] == short_frames);
            CHECK((words[kFlags] & ~kLost) == flags);
            CHECK((bench.read(kIrqStatus) & kLineError) == (flags != 0 ? kLineError : 0));
            bench.write(kIrqStatus, kLineError);
        };
        next(4, 0, 0, 0);
        next(4, 0, 0, 0);
        bench.source.missing_pixels = 3;
        next(4, 1, 0, kShortLine);
        next(4, 1, 0, 0);
        // One line less; the frame after it differs from it too.
        bench.source.missing_lines = 1;
        next(3, 1, 1, kShortFrame);
        next(4, 1, 2, kShortFrame);
        next(4, 1, 2, 0);
        // The other camera has sent nothing.
        const auto other = bench.block(1 - camera);
        CHECK(other[kFlags] == kLost);
        CHECK(
            std::all_of(other.begin(), other.begin() + 7, [](uint16_t word) { return word == 0; }));
        CHECK((bench.block(camera)[kFlags] & kLost) != 0);
        bench.source.set_period(bench.period_ps);
        bench.bridge.run(2 * kUs);
        CHECK((bench.block(camera)[kFlags] & kLost) == 0);
    }
}

TEST_CASE("what is expected decides; counts of errors end at 255") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        OneCamera bench(camera);
        bench.write(kExpectWidth, 16);
        bench.write(kExpectHeight, 4);
        bench.frames(3);
        auto words = bench.block(camera);
        CHECK(words[kShortLines] == 0);
        CHECK(words[kShortFrames] == 0);
        bench.write(kExpectWidth, 17);
        bench.frames(2);
        bench.write(kExpectWidth, 16);
        words = bench.block(camera);
        CHECK(words[kShortLines] >= 4);
        CHECK(words[kShortFrames] == 0);
        for (const unsigned wrong : {16u + 2048, 16u + 64, 4095u}) {
            bench.write(kExpectWidth, wrong);
            bench.write(kExpectHeight, wrong / 16);
            bench.frames(90);
            CHECK((bench.block(camera)[kFlags] & (kShortLine | kShortFrame)) ==
                  (kShortLine | kShortFrame));
        }
        words = bench.block(camera);
        CHECK(words[kShortLines] == 255);
        CHECK(words[kShortFrames] == 255);
    }
}

TEST_CASE("a height of more than 2048 lines is expected to the line") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        OneCamera bench(camera);
        hdl::Window window = small();
        window.width = 1;
        window.height = 2100;
        window.fixed = 24;
        bench.source.set_window(window);
        bench.write(kExpectWidth, 1);
        for (const unsigned expected : {2100u, 2101u, 2099u}) {
            CAPTURE(camera);
            CAPTURE(expected);
            bench.write(kExpectHeight, expected);
            bench.frames(2);
            bench.frames(2);
            CHECK(((bench.block(camera)[kFlags] & kShortFrame) != 0) == (expected != 2100));
        }
    }
}

TEST_CASE("sizes are counted up to 3840") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        OneCamera bench(camera);
        for (const unsigned count : {2730u, 1365u, kMax - 1, kMax, kMax + 1, 4100u}) {
            CAPTURE(camera);
            CAPTURE(count);
            hdl::Window window = small();
            window.width = count;
            window.height = 1;
            bench.source.set_window(window);
            bench.frames(2);
            bench.frames(2);
            CHECK(bench.block(camera)[kPixels] == std::min(count, kMax));
        }
        for (const unsigned count : {2730u, 1365u, 3900u}) {
            hdl::Window window = small();
            window.width = 1;
            window.height = count;
            window.fixed = 24;
            bench.source.set_window(window);
            bench.frames(2);
            bench.frames(2);
            CHECK(bench.block(camera)[kLines] == std::min(count, kMax));
        }
    }
}

TEST_CASE("one transfer shows one frame, and the next transfer the newest") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        OneCamera bench(camera);
        bench.next_frame();
        const uint32_t frames = bench.block(camera)[kFrames];
        const auto other_frames = [&] {
            hdl::Window window = small();
            window.width = 24;
            window.height = 6;
            bench.source.set_window(window);
            bench.next_frame();
            bench.next_frame();
            bench.source.missing_pixels = 1;
            bench.next_frame();
        };
        const auto held = bench.read_slowly(kCameras[camera], 8, other_frames);
        CHECK(held[kFrames] == frames);
        CHECK(held[kLines] == 4);
        CHECK(held[kPixels] == 16);
        CHECK((held[kFlags] & (kShortLine | kShortFrame)) == 0);
        // The first frame after it is compared with the one that was read.
        bench.next_frame();
        CHECK((bench.block(camera)[kFlags] & kShortFrame) != 0);
        bench.next_frame();
        const auto words = bench.block(camera);
        CHECK(words[kFrames] == frames + 5);
        CHECK(words[kLines] == 6);
        CHECK(words[kPixels] == 24);
        CHECK((words[kFlags] & (kShortLine | kShortFrame)) == 0);
        // A transfer that does not begin with the first word latches nothing.
        const auto rest = bench.read_slowly(uint8_t(kCameras[camera] + kLines), 7, other_frames);
        CHECK((rest[kFlags - 1] & kShortLine) != 0);
    }
}

TEST_CASE("a lost clock is reported once, and only for a camera that should run") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        OneCamera bench(camera);
        const auto reported = [&] {
            bench.bridge.run(300 * kUs);
            const bool lost = (bench.read(kIrqStatus) & kClockLost) != 0;
            bench.write(kIrqStatus, kClockLost);
            return lost;
        };
        // Outputs and clock of this camera alone.
        bench.write(kSensor, 0x51u << camera);
        bench.write(kCtrl, 0x0100);
        CHECK(!reported());
        bench.source.set_period(0);
        CHECK(reported());
        CHECK(!reported());
        bench.source.set_period(bench.period_ps);
        CHECK(!reported());
        bench.write(kCtrl, 0);
        bench.source.set_period(0);
        CHECK(!reported());
        bench.write(kCtrl, 0x0100);
        CHECK(reported());
    }
}

TEST_CASE("frames are counted modulo 65536") {
    Bench bench;
    const uint64_t half_ps = 10 * BRIDGE_CONTROL_PERIOD_PS;
    bench.bridge.set_clock(BRIDGE_CLOCK_LEFT, BRIDGE_CONTROL_PERIOD_PS);
    bench.bridge.set_clock(BRIDGE_CLOCK_RIGHT, BRIDGE_CONTROL_PERIOD_PS);
    bench.bridge.run(2 * kUs);
    const uint32_t frames = 65536 + 77;
    for (uint32_t i = 0; i < 2 * frames; i++) {
        bench.bridge.in.frame_valid[0] = bench.bridge.in.frame_valid[1] = i % 2 == 0;
        bench.bridge.drive();
        bench.bridge.run(half_ps);
    }
    bench.bridge.run(2 * kUs);
    CHECK(bench.block(0)[kFrames] == frames - 65536);
    CHECK(bench.block(1)[kFrames] == frames - 65536);
}

TEST_CASE("pixel clock and period of both cameras, to one count") {
    Bench bench;
    const hdl::Window window;
    hdl::PixelSource left(bench.bridge, 0, window), right(bench.bridge, 1, window);
    // Clocks that idle time's slow clock can also count: 16 periods take some us.
    left.set_period(400000);
    right.set_period(320000);
    bench.bridge.run_idle(100 * kMs);
    const unsigned khz[] = {2500, 3125};
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        const auto words = bench.block(camera);
        CHECK(std::abs(int(words[kPixclk]) - int(khz[camera])) <= 2);
        const double period_10us = double(window.frame_clocks()) / khz[camera] * 100;
        CHECK(std::abs(words[kPeriod] - period_10us) <= 1);
    }
    // Fast clocks; each camera in its turn: of 64 ms, the second and the last 16.
    bench.bridge.remove(left);
    bench.bridge.remove(right);
    for (const bool swapped : {false, true}) {
        const unsigned period_ps[] = {swapped ? 40773u : 20833u, swapped ? 20833u : 40773u};
        bench.bridge.reset();
        left.set_period(0);
        right.set_period(0);
        bench.bridge.run_idle(15900 * kUs);
        for (hdl::PixelSource *source : {&left, &right}) {
            source->set_period(period_ps[source == &right]);
            bench.bridge.run(16200 * kUs);
            source->set_period(0);
            bench.bridge.run_idle(15800 * kUs);
        }
        for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
            CHECK(std::abs(int(bench.block(camera)[kPixclk]) -
                           int(1000000000 / period_ps[camera])) <= 2);
        }
    }
}

TEST_CASE("clock and period are held with the block") {
    for (int camera = 0; camera < BRIDGE_CAMERAS; camera++) {
        CAPTURE(camera);
        Bench bench;
        const hdl::Window window;
        hdl::PixelSource left(bench.bridge, 0, window), right(bench.bridge, 1, window);
        left.set_period(400000);
        right.set_period(400000);
        // Its clock is measured at 32 or 64 ms, its period up to 10 ms later: during a transfer.
        bench.bridge.run_idle((camera == 0 ? 20 : 50) * kMs);
        const auto held =
            bench.read_slowly(kCameras[camera], 8, [&] { bench.bridge.run_idle(25 * kMs); });
        CHECK(held[kPixclk] == 0);
        CHECK(held[kPeriod] == 0);
        CHECK(bench.block(camera)[kPixclk] == 0);
        bench.bridge.run_idle(150 * kMs);
        CHECK(std::abs(int(bench.block(camera)[kPixclk]) - 2500) <= 2);
        CHECK(std::abs(int(bench.block(camera)[kPeriod]) - 203) <= 1);
    }
}

TEST_CASE("a camera without frames: the period ends at its greatest number") {
    Bench bench;
    // Both periods, one after the other, and only one frame for the left one's start.
    bench.bridge.set_clock(BRIDGE_CLOCK_LEFT, 4000000);
    bench.bridge.run_idle(70 * kMs);
    frame_at(bench.bridge, 0, bench.bridge.now() + kMs, kMs);
    bench.bridge.run_idle(1400 * kMs);
    CHECK(bench.block(0)[kPeriod] == 0xFFFF);
    CHECK(bench.block(1)[kPeriod] == 0xFFFF);
}

TEST_CASE("skew: how much later the right camera's frames start, with its sign") {
    for (const int64_t skew_us : {0, 999, 10922, -21845, 32760, -32760, 40000, -40000}) {
        CAPTURE(skew_us);
        Bench bench;
        bench.bridge.set_clock(BRIDGE_CLOCK_LEFT, kUs);
        bench.bridge.set_clock(BRIDGE_CLOCK_RIGHT, kUs);
        bench.bridge.run_idle(kMs);
        const uint64_t before = uint64_t(std::abs(skew_us) + 2000) * kUs;
        for (int i = 0; i < 2; i++) {
            const uint64_t left = bench.bridge.now() + before;
            frame_at(bench.bridge, 0, left, kMs);
            frame_at(bench.bridge, 1, uint64_t(int64_t(left) + skew_us * int64_t(kUs)), kMs);
            bench.bridge.run_idle(2 * before + 4 * kMs);
        }
        const auto check = [&] {
            const int64_t measured = int16_t(bench.read(kSkew));
            CHECK(std::abs(measured - std::clamp<int64_t>(skew_us, -32767, 32767)) <= 3);
        };
        check();
        // The time from the later camera to the earlier one's next frame is longer, and is not the
        // skew; if both exceed the counter's range, they cannot be distinguished.
        if (std::abs(skew_us) < 32767) {
            bench.bridge.run_idle(36 * kMs);
            frame_at(bench.bridge, skew_us < 0 ? 1 : 0, bench.bridge.now() + kMs, kMs);
            bench.bridge.run_idle(3 * kMs);
            check();
        }
    }
}

TEST_CASE("time is the microseconds since the reset, bit by bit") {
    const uint64_t seed = synthetic::test_seed();
    INFO("seed " << seed);
    hdl::Random random(seed);
    Bench bench;
    const auto ahead_us = [&bench] {
        return int64_t(bench.time_us()) - int64_t(bench.bridge.now() / kUs);
    };
    const int64_t first_us = ahead_us();
    // Each bit up to the 22nd is both 0 and 1 in some reading.
    for (uint64_t wait_us = 1; wait_us < 3000000; wait_us = wait_us * 3 / 2 + 1) {
        bench.bridge.run_idle((wait_us + random.below(uint32_t(wait_us) + 1)) * kUs);
        CAPTURE(wait_us);
        CHECK(std::abs(ahead_us() - first_us) <= 2);
    }
}

TEST_CASE("time of the frames that go to the PPI") {
    OneCamera bench(0);
    hdl::PpiReceiver ppi(bench.bridge);
    bench.write(kCtrl, 0x0100);
    for (const uint64_t later_ms : {0u, 300u, 400u, 1000u, 1400u, 1400u}) {
        bench.source.set_period(0);
        bench.bridge.run_idle(later_ms * kMs);
        bench.source.set_period(20833);
        bench.bridge.run(kMs);
        bench.write(kIrqStatus, 0xFF);
        const int64_t offset_us = int64_t(bench.time_us()) - int64_t(bench.bridge.now() / kUs);
        const auto words = bench.read_slowly(kFrameTime, 2, [&] { bench.frames(20); });
        const int64_t frame_us = int64_t(uint32_t(words[0]) << 16 | words[1]) - offset_us;
        uint64_t nearest = UINT64_MAX;
        for (const hdl::Received &frame : ppi.frames) {
            const int64_t begin_us = int64_t(frame.begin_ps / kUs);
            nearest = std::min(nearest, uint64_t(std::abs(begin_us - frame_us)));
        }
        CHECK(nearest <= 12);
        CHECK((bench.read(kIrqStatus) & kFrameStart) != 0);
    }
}
