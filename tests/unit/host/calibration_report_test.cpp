// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibration_report/calibration_report.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <sstream>

#include "calib/solve/solve.hpp"
#include "synthetic/rig_views.hpp"
#include "tools/host/calibration_report/calibration_report_figures.hpp"
#include "tools/host/calibration_report/calibration_report_sections.hpp"

namespace {

synthetic::RigViews make_views(double fill, double tilt_rad, int boards) {
    synthetic::RigViewsPlan plan;
    plan.width = 1280;
    plan.height = 960;
    plan.focal_px = 1600;
    plan.columns = 9;
    plan.rows = 6;
    plan.boards = boards;
    plan.fill = fill;
    plan.tilt_min_rad = 0.5 * tilt_rad;
    plan.tilt_max_rad = tilt_rad;
    plan.depth_range = 0.3;
    return synthetic::make_rig_views(plan, 3, 4);
}

calib::solution solve(const calib::observations &seen) {
    calib::solve_options options;
    options.choose_model = false;
    options.second_start = false;
    return calib::solve(seen, options);
}

std::string page_of(const calib::observations &seen, const calib::solution &result,
                    const std::string &title) {
    calibration_page page{&seen, &result, title, {}};
    std::ostringstream out;
    CHECK(calibration_report_write(page, out));
    return out.str();
}

}  // namespace

TEST_CASE("figures follow from corners and boards") {
    const synthetic::RigViews views = make_views(0.5, 0.6, 12);
    const calib::solution result = solve(views.seen);
    REQUIRE(result.solved);
    const calibration_figures figures = calibration_figures_collect(views.seen, result);
    REQUIRE(figures.camera.size() == 2);
    for (const calibration_pose &pose : figures.camera[0].poses) {
        const synthetic::Vector &t = views.t_left_board_mm[pose.capture];
        // The plan's boards are at 1800 mm, 30 % nearer or farther; their corner 0 is near.
        CHECK(std::fabs(pose.distance_mm - std::hypot(t.x, t.y, t.z)) < 700);
        CHECK(pose.tilt_deg < 60);
    }
    // 0.1 px of noise in each image: the rows differ by sqrt(2) of that.
    CHECK(figures.vertical_rms_px == doctest::Approx(0.1414).epsilon(0.15));
    const double square_mm = views.seen.target.square_mm;
    CHECK(figures.measured.square_mean_mm == doctest::Approx(square_mm).epsilon(2e-3));
    CHECK(figures.measured.square_rms_mm > 0);
    CHECK(figures.measured.plane_rms_mm > 0);
    CHECK(figures.measured.plane_rms_mm < 5);
    CHECK(calibration_figures_sigma_px(result, 0, 640, 480, INFINITY) > 0);
}

TEST_CASE("hints name what is missing") {
    const auto hints_of = [](double fill, double tilt_rad, int boards) {
        const synthetic::RigViews views = make_views(fill, tilt_rad, boards);
        const calib::solution result = solve(views.seen);
        REQUIRE(result.solved);
        std::string all;
        for (const std::string &hint : calibration_figures_collect(views.seen, result).hints) {
            all += hint + "\n";
        }
        return all;
    };
    const std::string small_flat_few = hints_of(0.25, 0.2, 6);
    INFO(small_flat_few);
    CHECK(small_flat_few.find("Next: the board in the ") == 0);
    CHECK(small_flat_few.find("6 board positions are used; take 6 more") != std::string::npos);
    CHECK(small_flat_few.find("never tilted away by more than") != std::string::npos);
    CHECK(small_flat_few.find(" corner") != std::string::npos);
    const std::string enough = hints_of(0.8, 0.7, 40);
    INFO(enough);
    CHECK(enough.find("board positions are used; take") == std::string::npos);
    CHECK(enough.find("never tilted") == std::string::npos);
}

TEST_CASE("pages: the same bytes, without pictures, without a solution, without harm") {
    const synthetic::RigViews views = make_views(0.5, 0.6, 8);
    const calib::solution result = solve(views.seen);
    REQUIRE(result.solved);
    const std::string hostile = "</title><script>alert(1)</script>";
    const std::string page = page_of(views.seen, result, hostile);
    CHECK(page == page_of(views.seen, result, hostile));
    CHECK(page.find(hostile) == std::string::npos);
    CHECK(page.find("id=\"residuals\"") != std::string::npos);
    CHECK(page.find("nan") == std::string::npos);

    calib::observations nothing = views.seen;
    for (calib::capture &capture : nothing.captures) {
        for (calib::board_view &view : capture.view) {
            view.corners.clear();
            view.rejection = "the board is not in the picture";
        }
    }
    const calib::solution unsolved = solve(nothing);
    REQUIRE_FALSE(unsolved.solved);
    const std::string sad = page_of(nothing, unsolved, "none");
    CHECK(sad.find("is-bad") != std::string::npos);
    CHECK(sad.find("the board is not in the picture") != std::string::npos);
    CHECK(sad.find("id=\"residuals\"") == std::string::npos);
}
