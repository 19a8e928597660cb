// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/world/document.hpp"

namespace simrig {

namespace {

using world::Entry;

ServoSettings read_servo(const Entry &entry) {
    ServoSettings servo;
    entry.read({{"centre_us", &servo.centre_us, 500, 2500},
                {"us_per_degree", &servo.us_per_degree, 1, 100},
                {"degrees_per_s", &servo.degrees_per_s, 1, 10000},
                {"min_us", &servo.min_us, 400, 2700},
                {"dead_band_us", &servo.dead_band_us, 0, 100},
                {"repeatability_deg", &servo.repeatability_degrees, 0, 10},
                {"offset_deg", &servo.offset_degrees, -45, 45},
                {"limp_ms", &servo.limp_ms, 20, 10000}},
               {"max_us", "play_deg", "creep_deg", "creep_s"});
    servo.max_us = entry.number("max_us", servo.min_us, 2700);
    servo.play_degrees = entry.number("play_deg", 0, 10, servo.play_degrees);
    servo.creep_degrees = entry.number("creep_deg", 0, 10, servo.creep_degrees);
    servo.creep_s = entry.number("creep_s", 0.1, 100000, servo.creep_s);
    return servo;
}

LensMotorSettings read_motor(const Entry &entry, double &position) {
    LensMotorSettings motor;
    entry.read({{"stop_low", &motor.stop_low, 0, 1023},
                {"counts_per_s", &motor.counts_per_s, 1, 100000},
                {"start_ms", &motor.start_ms, 0, 10000},
                {"backlash_counts", &motor.backlash_counts, 0, 100},
                {"min_step_counts", &motor.min_step_counts, 0, 100},
                {"read_noise_counts", &motor.read_noise_counts, 0, 100},
                {"outlier_chance", &motor.outlier_chance, 0, 1},
                {"settle_error_counts", &motor.settle_error_counts, 0, 100},
                {"drift_counts", &motor.drift_counts, -100, 100},
                {"drift_counts_per_h", &motor.drift_counts_per_h, -1000, 1000}},
               {"position", "stop_high"});
    motor.stop_high = entry.number("stop_high", motor.stop_low, 1023);
    position = entry.number("position", motor.stop_low, motor.stop_high);
    return motor;
}

SensorSettings read_link(const Entry &entry) {
    SensorSettings sensor;
    entry.read({{"clock_mhz", &sensor.clock_mhz, 1, 48},
                {"clock_error_ppm", &sensor.clock_error_ppm, -10000, 10000},
                {"answer_ns", &sensor.answer_ns, 0, 5000}});
    return sensor;
}

LensControllerSettings read_controller(const Entry &entry) {
    entry.allow({"model", "bits_per_s", "answer_ms", "lowest", "highest"});
    LensControllerSettings controller;
    controller.model = entry.has("model") ? entry.at("model").text() : controller.model;
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
    settings.warm_up_h = file.number("warm_up_h", 0, 1000, settings.warm_up_h);
    return settings;
}

}  // namespace simrig
