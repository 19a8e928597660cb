// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/settings.hpp"

#include "tools/simrig/world/document.hpp"

namespace simrig {

namespace {

using world::Entry;

ServoSettings read_servo(const Entry &entry) {
    entry.allow({"centre_us", "us_per_degree", "degrees_per_s", "min_us", "max_us", "dead_band_us",
                 "repeatability_deg", "offset_deg", "limp_ms"});
    ServoSettings servo;
    servo.centre_us = entry.number("centre_us", 500, 2500);
    servo.us_per_degree = entry.number("us_per_degree", 1, 100);
    servo.degrees_per_s = entry.number("degrees_per_s", 1, 10000);
    servo.min_us = entry.number("min_us", 400, 2700);
    servo.max_us = entry.number("max_us", servo.min_us, 2700);
    servo.dead_band_us = entry.number("dead_band_us", 0, 100);
    servo.repeatability_degrees = entry.number("repeatability_deg", 0, 10);
    servo.offset_degrees = entry.number("offset_deg", -45, 45);
    servo.limp_ms = entry.number("limp_ms", 20, 10000);
    return servo;
}

LensMotorSettings read_motor(const Entry &entry, double &position) {
    entry.allow({"position", "counts_per_s", "start_ms", "backlash_counts", "min_step_counts",
                 "stop_low", "stop_high", "read_noise_counts", "outlier_chance",
                 "settle_error_counts", "drift_counts_per_h"});
    LensMotorSettings motor;
    motor.stop_low = entry.number("stop_low", 0, 1023);
    motor.stop_high = entry.number("stop_high", motor.stop_low, 1023);
    position = entry.number("position", motor.stop_low, motor.stop_high);
    motor.counts_per_s = entry.number("counts_per_s", 1, 100000);
    motor.start_ms = entry.number("start_ms", 0, 10000);
    motor.backlash_counts = entry.number("backlash_counts", 0, 100);
    motor.min_step_counts = entry.number("min_step_counts", 0, 100);
    motor.read_noise_counts = entry.number("read_noise_counts", 0, 100);
    motor.outlier_chance = entry.number("outlier_chance", 0, 1);
    motor.settle_error_counts = entry.number("settle_error_counts", 0, 100);
    motor.drift_counts_per_h = entry.number("drift_counts_per_h", -1000, 1000);
    return motor;
}

SensorSettings read_link(const Entry &entry) {
    entry.allow({"clock_mhz", "clock_error_ppm", "answer_ns"});
    SensorSettings sensor;
    sensor.clock_mhz = entry.number("clock_mhz", 1, 48);
    sensor.clock_error_ppm = entry.number("clock_error_ppm", -10000, 10000);
    sensor.answer_ns = entry.number("answer_ns", 0, 5000);
    return sensor;
}

LensControllerSettings read_controller(const Entry &entry) {
    entry.allow({"bits_per_s", "answer_ms", "lowest", "highest"});
    LensControllerSettings controller;
    controller.bits_per_s = entry.number("bits_per_s", 300, 1000000);
    controller.answer_ms = entry.number("answer_ms", 0, 10000);
    controller.lowest = entry.at("lowest").whole(0, 1023);
    controller.highest = entry.at("highest").whole(controller.lowest, 1023);
    return controller;
}

}  // namespace

RigSettings load_settings(const std::string &path) {
    const Entry file = Entry::of_file(path);
    RigSettings settings;
    const char *const sides[] = {"left", "right"};
    const char *const axes[] = {"zoom", "focus", "iris"};
    for (size_t side = 0; side < 2; side++) {
        const Entry camera = file.at(sides[side]);
        settings.servo[side] = read_servo(camera.at("servo"));
        settings.sensor[side] = read_link(camera.at("link"));
        const Entry motors = camera.at("motors");
        motors.allow({"zoom", "focus", "iris"});
        for (size_t axis = 0; axis < kLensAxes; axis++) {
            LensSettings &lens = settings.lens[side];
            lens.motor[axis] = read_motor(motors.at(axes[axis]), lens.position[axis]);
        }
    }
    settings.lens_controller = read_controller(file.at("lens_controller"));
    return settings;
}

}  // namespace simrig
