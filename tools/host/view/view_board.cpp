// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_board.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/detect/detect.hpp"
#include "daemon/cli/option_page.h"
#include "tools/host/view/view_results.hpp"
#include "tools/host/view/view_source.hpp"
#include "tools/host/view/view_webcams.hpp"

namespace {

using nlohmann::json;

/// What one half shows.
json find_half(const view_picture &picture, int side, const calib::board &board) {
    std::vector<std::uint8_t> grey(
        static_cast<std::size_t>(picture.width_px / 2 * picture.height_px));
    view_picture_half(picture, side, grey.data());
    const int width = picture.width_px / 2;
    const image_u8 image = {grey.data(), width, picture.height_px, width};
    const calib::board_view found = calib::detect_board(board, image, {});
    json corners = json::array();
    for (const calib::corner &corner : found.corners) {
        corners.push_back(corner.x_px);
        corners.push_back(corner.y_px);
    }
    return {{"corners", corners},
            {"why", found.overexposed() ? "its white squares are too bright" : found.rejection}};
}

}  // namespace

std::string view_board_find(const view_picture &picture, int columns, int rows) {
    calib::board board;
    board.columns = columns;
    board.rows = rows;
    board.square_mm = 1;
    return json{{"number", picture.number},
                {"sides", {find_half(picture, 0, board), find_half(picture, 1, board)}}}
        .dump(-1, ' ', true);
}

std::string view_board_calibrate(view_source *source, const view_settings &settings,
                                 const std::string &body) {
    const json asked = json::parse(body, nullptr, false);
    if (!asked.is_object() || !asked.contains("sessions") || !asked["sessions"].is_array()) {
        return view_failed("SYNTAX", "not a request to calibrate");
    }
    std::string error;
    std::vector<std::string> words = {"vergence", "calibrate"};
    for (const json &session : asked["sessions"]) {
        const std::string name = session.is_string() ? session.get<std::string>() : "";
        const std::string here = view_result_fetch(source, settings, name, &error);
        if (here.empty()) {
            return view_failed("IO", error);
        }
        words.push_back(here);
    }
    const std::string out = settings.out + "/calibrated";
    words.insert(words.end(), {"--board", asked.value("board", ""), "--square",
                               asked.value("square", ""), "--out", out, "--quiet"});
    std::string command;
    std::string output;
    const int code = view_result_run(words, &command, &output);
    if (code != CLIENT_OK && code != CLIENT_NOT_GOOD) {
        return view_failed("FAILED", output);
    }
    if (!source->send(out + "/rig.calibration", "view.calibration", &error)) {
        return view_failed("IO", error);
    }
    return json{{"ok", true},         {"report", "out/calibrated"},
                {"command", command}, {"good", code == CLIENT_OK},
                {"verdict", output},  {"name", "view.calibration"}}
        .dump();
}
