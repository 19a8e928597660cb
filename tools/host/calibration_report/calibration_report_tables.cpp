// SPDX-License-Identifier: Apache-2.0
// All parameters of the solution with their error bars, and how the model was chosen.
#include <cmath>

#include "calib/solve/uncertainty.hpp"
#include "core/math.h"
#include "tools/host/calibration_report/calibration_report_sections.hpp"
#include "tools/host/formats/report_text.hpp"
#include "tools/host/page/page.hpp"

namespace {

/// Three columns: name, value, one sigma.
std::string row(const std::string &name, const std::string &value, const std::string &sigma) {
    return page_row(name, {value, sigma});
}

std::string valued(const std::string &name, double value, double sigma, int decimals,
                   const char *unit) {
    return row(name, report_text_format("%.*f%s", decimals, value, unit),
               sigma > 0 ? report_text_format("± %.*f", decimals, sigma) : std::string("fixed"));
}

std::string coefficient(const char *name, double value, bool estimated) {
    return row(name, report_text_format("%.6g", value), estimated ? "" : "fixed");
}

std::string lens_table(const calibration_page &page, int camera) {
    const calib::solution &result = *page.result;
    const lens &one = result.camera[camera];
    const auto side = static_cast<std::size_t>(camera);
    const calib::lens_model &model = result.model;
    std::string rows =
        row("image", report_text_format("%d × %d px", one.width_px, one.height_px), "one sigma") +
        valued("focal length, fx", one.fx_px, result.sigma.focal_px[side], 3, " px") +
        (model.square_pixels ? row("fy", "as fx", "")
                             : row("fy", report_text_format("%.3f px", one.fy_px), "")) +
        valued("principal point, cx", one.cx_px, result.sigma.centre_x_px[side], 3, " px") +
        valued("cy", one.cy_px, result.sigma.centre_y_px[side], 3, " px") +
        coefficient("k1", one.k1, model.estimates(calib::RADIAL_2)) +
        coefficient("k2", one.k2, model.estimates(calib::RADIAL_4)) +
        coefficient("p1", one.p1, model.estimates(calib::TANGENTIAL_1)) +
        coefficient("p2", one.p2, model.estimates(calib::TANGENTIAL_2)) +
        coefficient("k3", one.k3, model.estimates(calib::RADIAL_6));
    if (one.kind != LENS_BROWN_CONRADY) {
        rows += row("model", lens_kind_name(one.kind), "") +
                coefficient("k4", one.k4, model.estimates(calib::K4)) +
                coefficient("k5", one.k5, model.estimates(calib::K5));
    }
    static const struct {
        const char *name;
        int place;
    } moves[] = {{"k1 moves", calib::RADIAL_2},
                 {"k2 moves", calib::RADIAL_4},
                 {"p1 moves", calib::TANGENTIAL_1},
                 {"p2 moves", calib::TANGENTIAL_2},
                 {"k3 moves", calib::RADIAL_6},
                 {"k4 moves", calib::K4},
                 {"k5 moves", calib::K5}};
    const calib::lens_state state =
        calib::state_from_lens(calib::make_lens_frame(one.width_px, one.height_px), one);
    for (const auto &move : moves) {
        if (model.estimates(move.place) && result.errors != nullptr) {
            rows += valued(move.name, state.value[static_cast<std::size_t>(move.place)],
                           result.errors->lens_sigma(camera, move.place), 3, " px");
        }
    }
    return page_table(
        "Lens, " + std::string(calibration_report_side(page, camera)), {}, rows,
        "<p class=\"hint\">Displacement by a coefficient: of a point at half of the image's "
        "diagonal from the middle.</p>");
}

std::string rig_table(const calib::solution &result) {
    const calibration &rig = result.rig;
    std::string rows = row("", "", "one sigma");
    rows += valued("baseline", calibration_baseline_mm(&rig), result.sigma.baseline_mm, 3, " mm");
    const char *const axes[3] = {"x", "y", "z"};
    for (std::size_t i = 0; i < 3; i++) {
        rows += valued(std::string("left camera in the right frame, ") + axes[i],
                       rig.translation_right_left_mm[i], result.sigma.translation_mm[i], 3, " mm");
    }
    for (std::size_t i = 0; i < 3; i++) {
        rows += valued(std::string("rotation of the right camera, ") + axes[i],
                       MATH_DEGREE_PER_RAD * rig.rotation_right_left_rad[i],
                       MATH_DEGREE_PER_RAD * result.sigma.rotation_rad[i], 4, "°");
    }
    const double verged_mm = calibration_vergence_depth_mm(&rig);
    rows +=
        row("optical axes meet",
            verged_mm > 0 ? "at " + report_text_length(verged_mm, "mm") : "nowhere in front", "");
    return page_table("Rig", {}, rows);
}

std::string board_table(const calibration_page &page) {
    const calib::board &board = page.seen->target;
    std::string rows =
        row("inner corners", report_text_format("%d × %d", board.columns, board.rows), "") +
        row("side of a square", report_text_format("%.3f mm", board.square_mm), "as stated");
    if (board.coded()) {
        rows += row(
            "markers",
            report_text_escape(board.dictionary) + report_text_format(", %.3f mm", board.marker_mm),
            "");
    }
    rows +=
        page.result->target.bent
            ? row("bent along its rows", report_text_format("%+.3f mm", page.result->warp_mm[0]),
                  "edge over middle") +
                  row("bent along its columns",
                      report_text_format("%+.3f mm", page.result->warp_mm[1]), "edge over middle") +
                  row("twisted",
                      report_text_format("%+.3f mm",
                                         page.result->warp_mm[calib::board_model::TWIST]),
                      "a corner's height")
            : row("shape", "flat", "chosen");
    if (page.result->target.stretched) {
        rows += row(
            "rows longer than columns by",
            report_text_format("%+.3f mm", 2 * page.result->warp_mm[calib::board_model::STRETCH]),
            "over the width of its corners");
    }
    return page_table("Board", {}, rows);
}

std::string test_table(const calib::solution &result) {
    const calib::fit_test &fit = result.fit;
    const calib::start_test &again = result.second_start;
    std::string rows =
        row("corner errors over the noise of their images",
            report_text_format("%.2f times", fit.sigma_ratio), "1 for a perfect print and lens") +
        row("part beyond that noise", report_text_format("%.3f px", fit.floor_px),
            "print, compression; included in the error bars") +
        row("pattern over the image", report_text_format("%+.1f", fit.image_z), "below 3 or so") +
        row("pattern over the board", report_text_format("%+.1f", fit.board_z), "below 3 or so") +
        row("systematic part", report_text_format("%.3f px", fit.systematic_px),
            report_text_format("%.0f %% of the rms", 100 * fit.systematic_share)) +
        row("positions inconsistent by", report_text_format("%+.1f", fit.scatter_z),
            report_text_format("below 4; %.1f times the noise", std::sqrt(fit.scatter_ratio))) +
        row("error bars widened", report_text_format("%.2f times", fit.widened),
            fit.alarm ? "the model does not fit" : "1 where the model fits");
    rows += again.done ? row("second start", again.agrees ? "agrees" : "other solution",
                             report_text_format("focal lengths %.4f sigma apart",
                                                again.focal_difference_sigma))
                       : row("second start", "not done", "");
    return page_table("Tests of the solution", {}, rows);
}

std::string scores_table(const calib::solution &result) {
    if (result.scores.empty()) {
        return page_table("Choice of the model", {},
                          row(calib::lens_model_name(result.model), "given", ""));
    }
    std::string rows;
    for (const calib::model_score &score : result.scores) {
        rows += report_text_format(
            "<tr%s><th scope=\"row\">%s, %s board%s</th><td>%.4f px</td><td>%s</td></tr>\n",
            score.chosen ? " class=\"chosen\"" : "", calib::lens_model_name(score.model),
            calib::board_model_name(score.target), score.chosen ? " <b>chosen</b>" : "",
            score.held_out_rms_px,
            score.worse_than_best == 0 ? "best"
                                       : report_text_format("%+.3g ± %.2g", score.worse_than_best,
                                                            score.worse_than_best_sigma)
                                             .c_str());
    }
    return page_table(
        "Choice of the model", {"what is estimated", "rms, held out", "worse than the best"}, rows,
        "<p class=\"hint\">Five times, a fifth of the boards is held out and predicted from the "
        "others. The simplest that is within one standard error of the best is chosen. "
        "Differences: mean squared residual in units of sigma, per corner.</p>");
}

}  // namespace

std::string calibration_report_tables(const calibration_page &page,
                                      const calibration_figures &figures) {
    std::string html = scores_table(*page.result);
    html = "<div class=\"grid two\">\n" + html + test_table(*page.result) +
           "</div>\n<div "
           "class=\"grid two spaced\">\n";
    for (int camera = 0; camera < figures.cameras; camera++) {
        html += lens_table(page, camera);
    }
    if (figures.cameras == 2) {
        html += rig_table(page.result[0]);
    }
    return html + board_table(page) + "</div>\n";
}
