// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/solve/uncertainty.hpp"
#include "daemon/base/process.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/calibrate/calibrate_result.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"

namespace {

using json = nlohmann::ordered_json;

// Distances, in baselines, for which the deviation of the depth is stated.
const double depth_in_baselines[] = {5, 10, 20, 50};

json board_json(const calib::board &board) {
    json object = {{"corners", {board.columns, board.rows}}, {"square_mm", board.square_mm}};
    if (board.coded()) {
        object["dictionary"] = board.dictionary;
        object["marker_mm"] = board.marker_mm;
    }
    return object;
}

json camera_json(const calib::solution &solution, int camera) {
    const lens &lens = solution.camera[camera];
    const auto place = static_cast<size_t>(camera);
    json result = {
        {"size_px", {lens.width_px, lens.height_px}},
        {"focal_px", {lens.fx_px, lens.fy_px}},
        {"focal_sigma_px", solution.sigma.focal_px[place]},
        {"centre_px", {lens.cx_px, lens.cy_px}},
        {"centre_sigma_px", {solution.sigma.centre_x_px[place], solution.sigma.centre_y_px[place]}},
        {"model", lens_kind_name(lens.kind)},
        {"distortion_k1_k2_p1_p2_k3", {lens.k1, lens.k2, lens.p1, lens.p2, lens.k3}}};
    if (lens.kind != LENS_BROWN_CONRADY) {
        result["distortion_k4_k5_k6"] = {lens.k4, lens.k5, lens.k6};
    }
    return result;
}

/// The contribution of the calibration's own error to a depth in the middle of the left image.
json depth_json(const calib::solution &solution, double baseline_mm) {
    json list = json::array();
    const double middle_px[2] = {(solution.camera[0].width_px - 1) / 2.0,
                                 (solution.camera[0].height_px - 1) / 2.0};
    for (const double baselines : depth_in_baselines) {
        double sigma_mm;
        const double depth_mm = baselines * baseline_mm;
        if (solution.errors->depth_sigma(middle_px, depth_mm, &sigma_mm)) {
            list.push_back({{"depth_mm", depth_mm}, {"sigma_mm", sigma_mm}});
        }
    }
    return list;
}

json rig_json(const calibrate_result &result) {
    const calib::solution &solution = *result.solution;
    char crc[16];
    std::snprintf(crc, sizeof crc, "%08x", static_cast<unsigned>(calibration_crc(&result.rig)));
    const double *turn = result.rig.rotation_right_left_rad;
    const double *shift = solution.T_right_left.t_mm;
    const double baseline_mm = geometry_norm(shift);
    return {{"id", result.rig.id},
            {"crc32", crc},
            {"baseline_mm", baseline_mm},
            {"baseline_sigma_mm", solution.sigma.baseline_mm},
            {"rotation_right_left_rad", {turn[0], turn[1], turn[2]}},
            {"rotation_sigma_rad", solution.sigma.rotation_rad},
            {"translation_right_left_mm", {shift[0], shift[1], shift[2]}},
            {"translation_sigma_mm", solution.sigma.translation_mm},
            {"rows_rms_px", result.rows.rms_px},
            {"rows_max_px", result.rows.max_px},
            {"length_sigma",
             {{"length_mm", solution.length.length_mm},
              {"distance_mm", solution.length.distance_mm},
              {"sigma_mm", solution.length.sigma_mm}}},
            {"depth_sigma", depth_json(solution, baseline_mm)}};
}

json model_json(const calib::solution &solution) {
    json scores = json::array();
    for (const calib::model_score &score : solution.scores) {
        scores.push_back({{"model", calib::lens_model_name(score.model)},
                          {"board", calib::board_model_name(score.target)},
                          {"held_out_rms_px", score.held_out_rms_px},
                          {"worse_than_best", score.worse_than_best},
                          {"worse_than_best_sigma", score.worse_than_best_sigma},
                          {"chosen", score.chosen}});
    }
    return {{"lens", calib::lens_model_name(solution.model)},
            {"board", calib::board_model_name(solution.target)},
            {"board_bend_mm",
             {solution.warp_mm[calib::board_model::BEND_X],
              solution.warp_mm[calib::board_model::BEND_Y]}},
            {"board_twist_mm", solution.warp_mm[calib::board_model::TWIST]},
            {"board_stretch_mm", solution.warp_mm[calib::board_model::STRETCH]},
            {"candidates", scores}};
}

json fit_json(const calib::solution &solution) {
    const calib::fit_test &fit = solution.fit;
    const calib::start_test &again = solution.second_start;
    return {{"rms_px", solution.rms_px},
            {"held_out_rms_px", solution.held_out_rms_px},
            {"sigma0", solution.sigma0},
            {"captures_used", solution.captures_used},
            {"pairs_used", solution.pairs_used},
            {"image_z", fit.image_z},
            {"board_z", fit.board_z},
            {"systematic_px", fit.systematic_px},
            {"systematic_share", fit.systematic_share},
            {"sigma_ratio", fit.sigma_ratio},
            {"scatter_ratio", fit.scatter_ratio},
            {"scatter_z", fit.scatter_z},
            {"floor_px", fit.floor_px},
            {"alarm", fit.alarm},
            {"error_bars_widened", fit.widened},
            {"second_start",
             {{"done", again.done},
              {"agrees", again.agrees},
              {"focal_difference_sigma", again.focal_difference_sigma},
              {"cost_ratio", again.cost_ratio}}}};
}

json view_json(const calibrate_result &result, size_t shot, size_t camera) {
    const calib::capture &capture = result.views->seen.captures[shot];
    if (capture.name[camera].empty()) {
        return nullptr;
    }
    const calib::view_summary &summary = result.solution->views[shot][camera];
    json object = {{"name", capture.name[camera]},
                   {"corners", capture.view[camera].corners.size()},
                   {"corners_used", summary.corners_used},
                   {"rms_px", summary.used ? json(summary.rms_px) : json(nullptr)}};
    if (!capture.view[camera].rejection.empty()) {
        object["refused"] = capture.view[camera].rejection;
    }
    return object;
}

json boards_json(const calibrate_result &result) {
    json list = json::array();
    const calib::solution &solution = *result.solution;
    const calib::board &board = result.views->seen.target;
    for (size_t shot = 0; shot < result.views->seen.captures.size(); shot++) {
        json object;
        for (size_t camera = 0; camera < static_cast<size_t>(result.views->seen.cameras);
             camera++) {
            object[side_name[camera]] = view_json(result, shot, camera);
        }
        if (solution.board_known[shot]) {
            const calib::rigid &T = solution.T_left_board[shot];
            double min = INFINITY, greatest = -INFINITY;
            for (const int column : {0, board.columns - 1}) {
                for (const int row : {0, board.rows - 1}) {
                    const double z = T.R[6] * column * board.square_mm +
                                     T.R[7] * row * board.square_mm + T.t_mm[2];
                    min = std::min(min, z);
                    greatest = std::max(greatest, z);
                }
            }
            object["depth_mm"] = {min, greatest};
        }
        list.push_back(object);
    }
    return list;
}

json rejected_json(const calibrate_result &result) {
    json views = json::array(), corners = json::array();
    const auto name = [&](size_t shot, int camera) {
        return result.views->seen.captures[shot].name[static_cast<size_t>(camera)];
    };
    for (const calib::rejected_view &view : result.solution->rejected_views) {
        views.push_back({{"name", name(view.capture, view.camera)},
                         {"mended", view.repaired},
                         {"reason", view.reason}});
    }
    for (const calib::rejected_corner &corner : result.solution->rejected_corners) {
        corners.push_back({{"name", name(corner.capture, corner.camera)},
                           {"corner", corner.index},
                           {"off_px", corner.off_px},
                           {"reason", corner.reason}});
    }
    return {{"views", views}, {"corners", corners}};
}

}  // namespace

std::string calibrate_result_json(const calibrate_result &result) {
    const calib::solution &solution = *result.solution;
    const calib::verdict &verdict = result.solution->verdict;
    const bool pair = result.views->seen.cameras == 2;
    json page = {{"program", "vergence"},
                 {"version", version_text()},
                 {"kind", "calibration"},
                 {"verdict",
                  {{"good", verdict.good},
                   {"sentence", verdict.sentence},
                   {"reasons", verdict.reasons},
                   {"remarks", verdict.remarks}}},
                 {"board", board_json(result.views->seen.target)},
                 {"pictures", result.views->pictures},
                 {"pictures_with_board", result.views->boards}};
    for (int camera = 0; camera < result.views->seen.cameras; camera++) {
        page[pair ? side_name[camera] : "camera"] = camera_json(solution, camera);
    }
    if (pair) {
        page["rig"] = rig_json(result);
    }
    page["model"] = model_json(solution);
    page["fit"] = fit_json(solution);
    page["boards"] = boards_json(result);
    page["rejected"] = rejected_json(result);
    page["notes"] = result.notes;
    return page.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}
