// SPDX-License-Identifier: Apache-2.0
// Cost of the simulated rig: CPU seconds of this process next to the goals. Everything passes the
// Verilated bridge as on a board.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/rig/scenery.hpp"
#include "tools/simrig/rig/settings.hpp"

namespace {

using simrig::I2cMessage;

constexpr uint8_t kBridge = 0x2C, kSensor[2] = {0x5C, 0x5E};
constexpr double kMs = 1000, kDistanceMm = 1800;

double cpu_s() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// CPU seconds of a fixed piece of work, to compare machines (and days of a shared one): a
/// chain of ten million dependent steps in integers, a table and floating point.
double yardstick_s() {
    static double table[4096];
    for (double &entry : table) {
        entry = 1;
    }
    const double begin_s = cpu_s();
    uint64_t state = 1;
    double sum = 0;
    for (int i = 0; i < 10000000; i++) {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        double &entry = table[(state + uint64_t(sum)) % 4096];
        sum = 0.5 * sum + entry;
        entry = (state & 1u) != 0 ? sum : 1 / (1 + sum);
    }
    const double end_s = cpu_s();
    if (!(sum > 0)) {  // never true, but keeps the loop
        std::abort();
    }
    return end_s - begin_s;
}

std::string file(const std::string &name) {
    return std::string(SIMRIG_FILES) + "/" + name;
}

simrig::RigSettings settings_at(const world::Rig &rig, double zoom) {
    simrig::RigSettings settings = simrig::load_settings(file("rigs/default.yaml"));
    for (size_t side = 0; side < 2; side++) {
        settings.lens[side].position[simrig::kZoom] = zoom;
        settings.lens[side].position[simrig::kFocus] =
            world::focus_position_for(rig.camera[side].lens, zoom, kDistanceMm);
    }
    return settings;
}

/// A board with minimal drivers, in front of a scene.
class Bench {
  public:
    Bench(const std::string &scene, double zoom)
        : stage_(file("scenes/" + scene + ".yaml"), file("rigs/default.yaml"), 1, 1),
          rig(settings_at(stage_.rig(), zoom),
              [this](int camera, const simrig::SensorFrame &frame, double begin_us,
                     const std::function<simrig::CameraState(double)> &state) {
                  const double begin_s = cpu_s();
                  std::vector<uint16_t> pixels = stage_.picture(camera, frame, begin_us, state);
                  render_s += cpu_s() - begin_s;
                  return pixels;
              }) {
        rig.advance(rig.now_us() + 200, 0);
        write(kBridge, 0x56, 1);       // router of the sensors
        write(kBridge, 0x48, 0x00F3);  // sensors out of reset, with clocks and outputs
        write(kBridge, 0x08, 0x0103);  // servos and stream
        for (size_t side = 0; side < 2; side++) {
            write(kSensor[side], 0x09, 150);  // rows of exposure: 8 ms
            // Both look at the scene 1.8 m away.
            const simrig::ServoSettings servo;
            const double pan_deg = stage_.rig().camera[side].pan_rad * 180 / world::kPi;
            const double pulse_us = servo.centre_us + servo.us_per_degree * pan_deg;
            write(kBridge, uint8_t(0x10 + 8 * side), uint16_t(pulse_us * 16));
        }
    }

    void write(uint8_t address, uint8_t index, uint16_t value) {
        std::vector<I2cMessage> messages = {
            {address, false, {index, uint8_t(value >> 8), uint8_t(value)}}};
        if (rig.i2c(400000, messages).status != simrig::I2cStatus::kOk) {
            std::fprintf(stderr, "cost_bench: device 0x%02X does not answer\n", address);
            std::exit(1);
        }
    }
    void window(unsigned columns, unsigned rows) {
        for (const uint8_t sensor : kSensor) {
            write(sensor, 0x01, uint16_t(20 + (1536 - rows) / 4 * 2));
            write(sensor, 0x02, uint16_t(32 + (2048 - columns) / 4 * 2));
            write(sensor, 0x03, uint16_t(rows - 1));
            write(sensor, 0x04, uint16_t(columns - 1));
        }
        rig.advance(rig.now_us() + 400 * kMs, 0);
    }
    void capture(unsigned columns, unsigned rows) {
        rig.arm_frame(columns, rows);
        if (!rig.wait_frame(rig.now_us() + 2000 * kMs)) {
            std::fprintf(stderr, "cost_bench: no frame came\n");
            std::exit(1);
        }
        rig.take_frame();
    }
    /// Time passes as on a board that feeds the watchdog.
    void pass(double duration_us) {
        const double end_us = rig.now_us() + duration_us;
        while (rig.now_us() < end_us) {
            rig.advance(std::min(end_us, rig.now_us() + 250 * kMs), 0);
            write(kBridge, 0x04, 0);
        }
    }

  private:
    simrig::Stage stage_;

  public:
    simrig::Rig rig;
    double render_s = 0;
};

void report(const std::string &what, double value, double goal, const char *unit, int digits) {
    std::printf("%-44s %8.*f %s   goal %g%s\n", what.c_str(), digits, value, unit, goal,
                value <= goal ? "" : "   MISSED");
    std::fflush(stdout);
}

void measure_idle() {
    Bench bench("plane", 300);
    bench.pass(500 * kMs);
    const double begin_s = cpu_s();
    bench.pass(4000 * kMs);
    report("idle, for each second of virtual time", (cpu_s() - begin_s) / 4, 0.2, "CPU s", 3);
}

void measure_pair(const std::string &scene, double zoom) {
    Bench bench(scene, zoom);
    bench.pass(300 * kMs);
    bench.render_s = 0;
    const double begin_s = cpu_s();
    for (uint16_t camera = 0; camera < 2; camera++) {
        bench.write(kBridge, 0x20, camera);
        bench.capture(2048, 1536);
    }
    const double all_s = cpu_s() - begin_s;
    char what[96];
    std::snprintf(what, sizeof what, "pair, %s at %s (light %.2f)", scene.c_str(),
                  zoom < 500 ? "1x" : "10x", bench.render_s);
    report(what, all_s, 6, "CPU s", 2);
}

void measure_window() {
    Bench bench("cylinder", 300);
    bench.window(100, 100);
    constexpr int kFrames = 20;
    bench.render_s = 0;
    const double begin_s = cpu_s();
    for (int i = 0; i < kFrames; i++) {
        bench.capture(100, 100);
    }
    const double frame_ms = (cpu_s() - begin_s) / kFrames * 1000;
    char what[64];
    std::snprintf(what, sizeof what, "window of 100 x 100 (light %.1f)",
                  bench.render_s / kFrames * 1000);
    report(what, frame_ms, 20, "CPU ms", 1);
}

void measure_zoom() {
    Bench bench("plane", 300);
    bench.pass(100 * kMs);
    const double begin_s = cpu_s(), begin_us = bench.rig.now_us();
    const std::string go = "1Z850\n2Z850\n";
    bench.rig.serial().send(bench.rig.now_ps(), {go.begin(), go.end()});
    const auto under_way = [&bench] {
        return std::fabs(bench.rig.state(0).zoom - 850) > 4 ||
               std::fabs(bench.rig.state(1).zoom - 850) > 4;
    };
    while (under_way() && bench.rig.now_us() < begin_us + 20000 * kMs) {
        // As a driver polls the motors' positions.
        const std::string ask = "1?\n2?\n";
        bench.rig.serial().send(bench.rig.now_ps(), {ask.begin(), ask.end()});
        bench.pass(200 * kMs);
        bench.rig.serial().take(bench.rig.now_ps());
    }
    char what[64];
    std::snprintf(what, sizeof what, "zoom from end to end (%.1f s of virtual time)",
                  (bench.rig.now_us() - begin_us) * 1e-6);
    report(what, cpu_s() - begin_s, 2, "CPU s", 2);
}

}  // namespace

int main(int count, char **arguments) {
    const std::string only = count > 1 ? arguments[1] : "";
    const auto wanted = [&only](const char *name) { return only.empty() || only == name; };
    std::printf("yardstick                                    %8.3f CPU s\n", yardstick_s());
    if (wanted("idle")) {
        measure_idle();
    }
    if (wanted("zoom")) {
        measure_zoom();
    }
    if (wanted("window")) {
        measure_window();
    }
    for (const char *scene :
         {"plane", "chessboard", "charuco", "cylinder", "mug", "figurine", "level", "still_life"}) {
        if (wanted("pair") || only == scene) {
            measure_pair(scene, 300);
            measure_pair(scene, 850);
        }
    }
    return 0;
}
