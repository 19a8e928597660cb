// SPDX-License-Identifier: Apache-2.0
// Widths, angles and times of a servo, compared with the simulated one with its numbers of
// rigs/default.yaml.
#include "device/servo.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/error.h"
#include "synthetic/seed.hpp"
#include "tools/simrig/devices/noise.hpp"
#include "tools/simrig/devices/servo.hpp"

namespace {

constexpr double kPi = 3.14159265358979323846;

int draws(int default_value) {
    const char *text = std::getenv("VERGENCE_DRAWS");
    return text != nullptr ? std::atoi(text) : default_value;
}

// Time from a request until the simulated horn has stopped, with pulses as the bridge sends them:
// the request comes this long before the next pulse.
double simulated_us(simrig::Servo &servo, uint16_t from_q4, uint16_t to_q4, uint16_t slew_q4,
                    double period_us, double before_us, double start_us) {
    int width_q4 = from_q4;
    double pulse_us = start_us + before_us, stands_us = start_us;
    for (int pulses = 0; pulses < 20 || width_q4 != to_q4; pulses++) {
        const int step = slew_q4 == 0 ? 65535 : int(slew_q4);
        width_q4 += std::clamp(int(to_q4) - width_q4, -step, step);
        servo.edge(pulse_us, true);
        servo.edge(pulse_us + width_q4 / 16.0, false);
        for (double t = pulse_us + width_q4 / 16.0; t < pulse_us + period_us - 1; t += 250) {
            stands_us = servo.moving(t) ? t : stands_us;
        }
        pulse_us += period_us;
    }
    return stands_us - start_us;
}

}  // namespace

TEST_CASE("the HS-322HD's widths") {
    const servo_model model = servo_hs322hd();
    uint16_t width_q4 = 0;
    CHECK(servo_width_q4(&model, 0, &width_q4) == ERROR_OK);
    CHECK(width_q4 == 24000);
    CHECK(servo_width_q4(&model, int32_t(std::lround(kPi / 180 * 1e6)), &width_q4) == ERROR_OK);
    CHECK(std::abs(width_q4 - (24000 + 10.3 * 16)) <= 0.6);
    CHECK(servo_width_q4(&model, int32_t(std::lround(-45 * kPi / 180 * 1e6)), &width_q4) ==
          ERROR_OK);
    CHECK(std::abs(width_q4 - (24000 - 45 * 10.3 * 16)) <= 1);
}

TEST_CASE("there and back is half a sixteenth of a microsecond at most") {
    const servo_model model = servo_hs322hd();
    for (int32_t angle = -1525000; angle <= 1525000; angle += 97) {
        uint16_t width_q4 = 0;
        REQUIRE(servo_width_q4(&model, angle, &width_q4) == ERROR_OK);
        REQUIRE(std::abs(servo_angle_urad(&model, width_q4) - angle) <= 53);
    }
    for (int width = model.min_q4; width <= model.max_q4; width++) {
        uint16_t width_q4 = 0;
        REQUIRE(servo_width_q4(&model, servo_angle_urad(&model, uint16_t(width)), &width_q4) ==
                ERROR_OK);
        REQUIRE(width_q4 == width);
    }
}

TEST_CASE("limits hold to the last sixteenth, and nothing is stored beyond them") {
    const servo_model model = servo_hs322hd();
    uint16_t width_q4 = 7;
    const int32_t max = servo_angle_urad(&model, model.max_q4);
    const int32_t min = servo_angle_urad(&model, model.min_q4);
    for (int32_t angle : {max + 106, min - 106, INT32_MAX, INT32_MIN}) {
        CHECK(servo_width_q4(&model, angle, &width_q4) == ERROR_RANGE);
        CHECK(width_q4 == 7);
    }
    CHECK(servo_width_q4(&model, max, &width_q4) == ERROR_OK);
    CHECK(width_q4 == model.max_q4);
    CHECK(servo_width_q4(&model, min, &width_q4) == ERROR_OK);
    CHECK(width_q4 == model.min_q4);
}

TEST_CASE("a travel in numbers") {
    servo_model model = servo_hs322hd();
    CHECK(servo_travel_us(&model, 24000, 24000, 480, 20000) == 0);
    // Without slew limit: the period, the pulse, 60 degrees in 0.19 s, settling.
    const uint16_t sixty_q4 = uint16_t(24000 + 60 * 10.3 * 16);
    CHECK(servo_travel_us(&model, 24000, sixty_q4, 0, 20000) ==
          doctest::Approx(20000 + 2401 + 190400 + 100000).epsilon(0.002));
    CHECK(servo_travel_us(&model, sixty_q4, 24000, 0, 20000) ==
          servo_travel_us(&model, 24000, sixty_q4, 0, 20000));
    // A slew slower than the horn dominates: 21 pulses, the last of them for the rest.
    CHECK(servo_travel_us(&model, 24000, sixty_q4, 480, 20000) ==
          doctest::Approx(20000 + 2401 + 20 * 20000 + 5700 + 100000).epsilon(0.02));
    // The whole range, one step per pulse.
    CHECK(servo_travel_us(&model, 9600, 38400, 1, 65535) > 28800ull * 65535);
}

TEST_CASE("the simulated servo rests in time, and not long before") {
    const uint64_t seed = synthetic::test_seed();
    simrig::Noise noise(seed);
    double longest_part = 0;
    for (int i = 0; i < draws(300); i++) {
        INFO("VERGENCE_SEED=" << seed << " draw " << i);
        simrig::ServoSettings settings;
        simrig::Servo servo(settings, noise.next());
        const servo_model model = servo_hs322hd();
        const auto width = [&] {
            return uint16_t(model.min_q4 + noise.next() % (model.max_q4 - model.min_q4 + 1u));
        };
        const uint16_t from_q4 = width(),
                       to_q4 = noise.chance(0.3) ? uint16_t(std::clamp(from_q4 + 200, 0, 38400))
                                                 : width();
        const uint16_t slew_q4 = noise.chance(0.2) ? 0 : uint16_t(30 + noise.next() % 2000);
        const double before_us = 20000 * noise.uniform();
        const double first_us = 1e6 + simulated_us(servo, from_q4, from_q4, 0, 20000, before_us, 0);
        const double took_us = simulated_us(servo, from_q4, to_q4, slew_q4, 20000, before_us,
                                            std::max(first_us, 20 * 20000.0));
        const auto reported_us = double(servo_travel_us(&model, from_q4, to_q4, slew_q4, 20000));
        CHECK(took_us <= reported_us);
        longest_part = std::max(longest_part, (took_us + model.settle_us) / reported_us);
    }
    CHECK(longest_part > 0.9);  // the estimate is not far too long
}
