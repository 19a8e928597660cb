// SPDX-License-Identifier: Apache-2.0
#include "stereo/zoom/zoom_calibration.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include "core/crc.h"
#include "core/error.h"
#include "stereo/geometry/geometry.h"
#include "stereo/zoom/zoom_aim.h"
#include "stereo/zoom/zoom_sigma.h"
#include "synthetic/zoom_rig.hpp"

namespace {

std::string print(const zoom_calibration &calibration) {
    std::vector<char> text(ZOOM_TEXT_MAX_BYTES);
    const int length = zoom_calibration_print(&calibration, text.data(), text.size());
    REQUIRE(length > 0);
    return std::string(text.data(), static_cast<size_t>(length));
}

int parse(const std::string &text, zoom_calibration &result, calibration_fault *fault = nullptr) {
    return zoom_calibration_parse(text.data(), text.size(), nullptr, &result, fault);
}

}  // namespace

TEST_CASE("a zoom calibration projects as the rig that it describes") {
    const auto calibration = zoom_rig::calibration();
    for (const double zoom : {300.0, 337.0, 421.6, 575.0, 850.0}) {
        const zoom_state state = zoom_rig::state(zoom, 1800);
        zoom_pair pair;
        zoom_pair_at(calibration->camera, &state, &pair);
        double worst_px = 0;
        for (int side = 0; side < 2; side++) {
            const auto &at = state.side[side];
            const auto truth =
                zoom_rig::camera_at(side, at.zoom_counts, at.focus_counts, at.pan_rad, false);
            const double scale = 1800 * 300 / truth.fx;  // the points fill the image
            for (int i = 0; i < 9; i++) {
                const double point_mm[3] = {125 + (i % 3 - 1) * scale, (i / 3 - 1) * scale,
                                            1700.0 + 20 * i};
                double arm_mm[3], in_camera[3], pixel_px[2];
                const auto expected = truth.project({point_mm[0], point_mm[1], point_mm[2]});
                REQUIRE(expected);
                for (int j = 0; j < 3; j++) {
                    arm_mm[j] = point_mm[j] - pair.side[side].position_mm[j];
                }
                geometry_rotate_back(pair.side[side].R_instrument_camera, arm_mm, in_camera);
                REQUIRE(lens_project(&pair.side[side].lens, in_camera, pixel_px));
                worst_px = std::max(
                    worst_px, std::hypot(pixel_px[0] - expected->x, pixel_px[1] - expected->y));
            }
        }
        INFO("zoom ", zoom, ": ", worst_px, " px");
        CHECK(worst_px < 0.1);  // what eight terms leave of the arc that the image centre makes
    }
}

TEST_CASE("any state of a zoom calibration is a calibration of one state") {
    const auto zoomed = zoom_rig::calibration();
    const zoom_state state = zoom_rig::state(421.6, 1800);
    calibration at;
    calibration_fault fault{};
    REQUIRE(zoom_calibration_at(zoomed.get(), &state, &at, &fault) == ERROR_OK);
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&at, text, sizeof text);
    REQUIRE(length > 0);
    calibration parsed;
    REQUIRE(calibration_parse(text, static_cast<size_t>(length), &parsed, &fault) == ERROR_OK);
    CHECK(parsed.axes_in_sigma);
    CHECK(at.left.width_px == 2048);
    CHECK(calibration_vergence_depth_mm(&at) == doctest::Approx(1800).epsilon(0.05));
    CHECK(at.origin.side[1].axis[CALIBRATION_ZOOM].mean == 421.6);
    // 0.3 degrees of both servos.
    CHECK(at.yaw_sigma_rad == doctest::Approx(std::sqrt(2.0) * 0.3 * 0.017453).epsilon(0.1));
    CHECK(at.scale_sigma < 0.015);
}

TEST_CASE("nothing is extrapolated, and the axis is named") {
    const auto zoomed = zoom_rig::calibration();
    calibration at;
    calibration_fault fault{};
    zoom_state state = zoom_rig::state(852, 1800);  // 852 is within the motor's drift
    CHECK(zoom_calibration_at(zoomed.get(), &state, &at, &fault) == ERROR_OK);
    state = zoom_rig::state(860, 1800);
    CHECK(zoom_calibration_at(zoomed.get(), &state, &at, &fault) == ERROR_RANGE);
    CHECK(std::string(fault.field) == "left_zoom_counts");
    state = zoom_rig::state(500, 1800);
    state.side[1].focus_counts = 280;
    CHECK(zoom_calibration_at(zoomed.get(), &state, &at, &fault) == ERROR_RANGE);
    CHECK(std::string(fault.field) == "right_focus_counts");
    state = zoom_rig::state(500, 1800);
    state.side[0].pan_rad = std::nan("");
    CHECK(zoom_calibration_at(zoomed.get(), &state, &at, nullptr) == ERROR_RANGE);
}

std::string with_crc(const std::string &text) {
    const std::string body = text.substr(0, text.rfind("crc32 "));
    char line[32];
    std::snprintf(line, sizeof line, "crc32 %08x\n", crc_update(0, body.data(), body.size()));
    return body + line;
}

TEST_CASE("the text of a zoom calibration is exact") {
    auto zoomed = zoom_rig::calibration();
    // Correlated parameters, too.
    for (int i = 1; i < zoomed->parameters; i++) {
        const double *covariance = zoomed->covariance;
        zoomed->covariance[i * (i + 1) / 2 + i - 1] =
            0.3 * std::sqrt(covariance[i * (i + 1) / 2 + i] * covariance[(i - 1) * (i + 2) / 2]);
    }
    const std::string text = print(*zoomed);
    CHECK(text.find("vergence-zoom-calibration 2\nid default-rig\n") == 0);
    auto parsed = std::make_unique<zoom_calibration>();
    calibration_fault fault{};
    REQUIRE(parse(text, *parsed, &fault) == ERROR_OK);
    CHECK(print(*parsed) == text);
    const zoom_state state = zoom_rig::state(700, 1800);
    calibration from_parsed, from_original;
    REQUIRE(zoom_calibration_at(parsed.get(), &state, &from_parsed, nullptr) == ERROR_OK);
    REQUIRE(zoom_calibration_at(zoomed.get(), &state, &from_original, nullptr) == ERROR_OK);
    CHECK(std::fabs(from_parsed.left.fx_px - from_original.left.fx_px) < 1e-6);
    CHECK(from_parsed.yaw_sigma_rad == doctest::Approx(from_original.yaw_sigma_rad).epsilon(1e-6));
}

TEST_CASE("a text of version 1 is read, with its own names of fields only") {
    const std::string text = print(*zoom_rig::calibration());
    std::string old = std::regex_replace(text, std::regex("calibration 2"), "calibration 1");
    auto parsed = std::make_unique<zoom_calibration>();
    calibration_fault fault{};
    CHECK(parse(with_crc(old), *parsed, &fault) == ERROR_MISSING);
    CHECK(std::string(fault.field) == "left_vergence");
    old = std::regex_replace(old, std::regex("_focus_dioptre_by_count"), "_focus_vergence");
    old = std::regex_replace(old, std::regex("_focus_dioptre"), "_vergence");
    REQUIRE(parse(with_crc(old), *parsed, &fault) == ERROR_OK);
    CHECK(print(*parsed) == text);
    CHECK(parse(with_crc(std::regex_replace(old, std::regex("calibration 1"), "calibration 2")),
                *parsed, &fault) == ERROR_MISSING);
}

TEST_CASE("a damaged text is refused with its line") {
    const std::string text = print(*zoom_rig::calibration());
    auto parsed = std::make_unique<zoom_calibration>();
    calibration_fault fault{};
    std::string changed = text;
    changed[text.find("left_focal") + 20] ^= 1;
    CHECK(parse(changed, *parsed, &fault) != ERROR_OK);
    CHECK(parse(text.substr(0, text.size() / 2), *parsed, &fault) != ERROR_OK);
    CHECK(parse("vergence-zoom-calibration 3\n", *parsed, &fault) == ERROR_VERSION);
    CHECK(parse("vergence-calibration 2\n", *parsed, &fault) == ERROR_SYNTAX);
    changed = text;
    changed.erase(text.find("left_focal "),
                  text.find("left_focus_dioptre ") - text.find("left_focal "));
    CHECK(parse(changed, *parsed, &fault) == ERROR_MISSING);
    CHECK(std::string(fault.field) == "left_focal");
    CHECK(fault.line == 14);
    changed = text;
    changed.replace(text.find("left_focal "), 10, "left_pan_rad");
    CHECK(parse(changed, *parsed, &fault) == ERROR_DUPLICATE);
    changed = std::regex_replace(text, std::regex("\ndate .*\n"), "\ndate 2026-02-30\n");
    CHECK(parse(with_crc(changed), *parsed, &fault) == ERROR_SYNTAX);
    CHECK(fault.line == 3);
    changed = text;
    changed.replace(text.find("\nparameters ") + 12, 1, "9");
    CHECK(parse(changed, *parsed, &fault) != ERROR_OK);
    CHECK(std::string(fault.field) == "parameters");
}

TEST_CASE("a model that is not defined over its ranges is refused") {
    auto zoomed = zoom_rig::calibration();
    calibration_fault fault{};
    zoomed->camera[1].function[ZOOM_FOCAL].term[1] *= 2;  // negative at the wide end
    CHECK(zoom_calibration_validate(zoomed.get(), &fault) != ERROR_OK);
    CHECK(std::string(fault.field) == "right_focal");
    zoomed = zoom_rig::calibration();
    zoomed->camera[0].zoom.max = zoomed->camera[0].zoom.min;
    CHECK(zoom_calibration_validate(zoomed.get(), &fault) == ERROR_RANGE);
    zoomed = zoom_rig::calibration();
    std::fill_n(&zoomed->camera[1].mount[ZOOM_POSITION_X], 3, 0.0);
    CHECK(zoom_calibration_validate(zoomed.get(), &fault) == ERROR_RANGE);
    CHECK(std::string(fault.field) == "right_position_mm");
    zoomed = zoom_rig::calibration();
    zoomed->covariance[1] = 1;  // larger than the variances allow
    CHECK(zoom_calibration_validate(zoomed.get(), &fault) == ERROR_RANGE);
    zoomed->covariance[0] = std::nan("");
    CHECK(zoom_calibration_validate(zoomed.get(), &fault) == ERROR_RANGE);
}

TEST_CASE("the uncertainty of depth has its parts") {
    const auto zoomed = zoom_rig::calibration();
    const zoom_state state = zoom_rig::state(300, 1800);
    const double middle_px[2] = {1024, 768};
    const zoom_variance variance = zoom_depth_variance(zoomed.get(), &state, middle_px, 1800);
    // dz = z^2 / baseline * angle, of two servos.
    const double expected_mm = 1800.0 * 1800 / 250 * std::sqrt(2.0) * 0.3 * 0.0174533;
    CHECK(std::sqrt(variance.pan) == doctest::Approx(expected_mm).epsilon(0.05));
    CHECK(variance.lens > 0);
    CHECK(variance.motor > 0);
    CHECK(variance.mount > 0);
    CHECK(zoom_variance_sum(&variance) > variance.pan);
    // The right camera at 10x, turned away, does not see a point at 1 m.
    const zoom_state far_state = zoom_rig::state(840, 10000);
    const zoom_variance unseen = zoom_depth_variance(zoomed.get(), &far_state, middle_px, 1000);
    CHECK(zoom_variance_sum(&unseen) == 0);
}

TEST_CASE("both cameras are turned to a point, and focused for a distance") {
    const auto zoomed = zoom_rig::calibration();
    for (const double right_mm : {-150.0, 0.0, 80.0}) {
        zoom_state state = zoom_rig::state(600, 1000);
        double point_mm[3];
        zoom_point_ahead(zoomed.get(), 1800, right_mm, point_mm);
        REQUIRE(zoom_aim(zoomed.get(), point_mm, &state, nullptr) == ERROR_OK);
        for (int side = 0; side < 2; side++) {
            const auto truth = zoom_rig::camera_at(side, 600, 500, state.side[side].pan_rad, false);
            const auto pixel = truth.project({point_mm[0], point_mm[1], point_mm[2]});
            REQUIRE(pixel);
            CHECK(pixel->x == doctest::Approx(truth.cx).epsilon(1e-3));
        }
    }
    zoom_state state = zoom_rig::state(600, 1000);
    double point_mm[3];
    calibration_fault fault{};
    zoom_point_ahead(zoomed.get(), 250, 0, point_mm);
    CHECK(zoom_aim(zoomed.get(), point_mm, &state, &fault) == ERROR_RANGE);
    CHECK(std::string(fault.field) == "left_pan_rad");
    zoom_point_ahead(zoomed.get(), -500, 0, point_mm);
    CHECK(zoom_aim(zoomed.get(), point_mm, &state, nullptr) == ERROR_RANGE);
    for (int side = 0; side < 2; side++) {
        const double counts = zoom_focus_counts(&zoomed->camera[side], 600, 1800);
        CHECK(counts ==
              doctest::Approx(zoom_rig::state(600, 1800).side[side].focus_counts).epsilon(1e-3));
    }
}
