// SPDX-License-Identifier: Apache-2.0
#include "tools/host/info/info_zoom.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

#include "console/command_words.h"
#include "core/error.h"
#include "core/math.h"
#include "daemon/files/input_file.h"
#include "daemon/session/calibration_read.h"
#include "daemon/session/session_pairs.h"
#include "stereo/zoom/zoom_aim.h"
#include "stereo/zoom/zoom_sigma.h"
#include "tools/host/formats/report_text.hpp"

namespace {

using json = nlohmann::ordered_json;

const char *const sides[2] = {"left", "right"};

void focal_lengths(const zoom_pair *pair, void *, double *values) {
    values[0] = pair->side[0].f_px;
    values[1] = pair->side[1].f_px;
}

/// A state in the middle of the ranges of focus and pan.
zoom_state middle_at(const zoom_calibration &value, double part) {
    zoom_state state{};
    for (int side = 0; side < 2; side++) {
        const zoom_camera &camera = value.camera[side];
        state.side[side].zoom_counts = camera.zoom.min + part * (camera.zoom.max - camera.zoom.min);
        state.side[side].focus_counts = (camera.focus.min + camera.focus.max) / 2;
        state.side[side].pan_rad = (camera.pan_rad.min + camera.pan_rad.max) / 2;
    }
    return state;
}

void add_camera(const zoom_calibration &value, int side, info_page *page) {
    const zoom_camera &camera = value.camera[side];
    page->add("", std::string(sides[side]) + " camera",
              (*camera.name != '\0' ? camera.name : std::string("camera not known")) + ", " +
                  std::to_string(camera.width_px) + " x " + std::to_string(camera.height_px) +
                  " px of " + number_text(1000 * camera.pixel_mm, 4) + " um",
              nullptr);
    page->add("", "  calibrated",
              "zoom " + number_text(camera.zoom.min, 5) + ".." + number_text(camera.zoom.max, 5) +
                  ", focus " + number_text(camera.focus.min, 5) + ".." +
                  number_text(camera.focus.max, 5) + " counts, pan " +
                  number_text(MATH_DEGREE_PER_RAD * camera.pan_rad.min, 4) + ".." +
                  number_text(MATH_DEGREE_PER_RAD * camera.pan_rad.max, 4) + " degrees",
              nullptr);
    json focal = json::array();
    for (int i = 0; i <= 4; i++) {
        const zoom_state state = middle_at(value, i / 4.0);
        zoom_pair pair;
        zoom_variance variance[2];
        zoom_pair_at(value.camera, &state, &pair);
        zoom_propagate(&value, &state, focal_lengths, nullptr, 2, variance);
        const double f_px = pair.side[side].f_px;
        const double sigma = std::sqrt(variance[side].lens) / f_px;
        const double motor = std::sqrt(variance[side].motor) / f_px;
        page->add("", i == 0 ? "  focal length" : "",
                  number_text(f_px * camera.pixel_mm, 5) + " mm (" + number_text(f_px, 6) +
                      " px) at " + number_text(state.side[side].zoom_counts, 5) + ", +- " +
                      number_text(100 * sigma, 2) + " % and " + number_text(100 * motor, 2) +
                      " % by the motor",
                  nullptr);
        focal.push_back({{"zoom_counts", state.side[side].zoom_counts},
                         {"focal_px", f_px},
                         {"sigma", sigma},
                         {"motor_sigma", motor}});
    }
    page->add(
        sides[side], "", "",
        {{"camera", camera.name},
         {"size_px", {camera.width_px, camera.height_px}},
         {"pixel_mm", camera.pixel_mm},
         {"zoom_counts", {camera.zoom.min, camera.zoom.max}},
         {"focus_counts", {camera.focus.min, camera.focus.max}},
         {"pan_deg",
          {MATH_DEGREE_PER_RAD * camera.pan_rad.min, MATH_DEGREE_PER_RAD * camera.pan_rad.max}},
         {"focal_length", focal}});
}

void add_checks(const zoom_calibration &value, info_page *page) {
    const zoom_validation &check = value.validation;
    page->add("rms_px", "rms",
              number_text(check.rms_px, 4) + " px of " + std::to_string(check.corners) +
                  " corners on " + std::to_string(check.boards) + " boards at " +
                  std::to_string(check.settings) + " settings, " +
                  std::to_string(check.rejected_corners) + " corners rejected",
              check.rms_px);
    page->add("held_out_px", "at settings left out",
              check.held_out_px > 0
                  ? number_text(check.held_out_px, 3) + " px epipolar, " +
                        number_text(100 * check.held_out_focal, 3) + " % of the focal length"
                  : std::string("not checked"),
              check.held_out_px > 0 ? json(check.held_out_px) : json(nullptr));
    page->add("chi_square_z", "standard score of the fit",
              number_text(check.chi_square_z, 3) +
                  (check.chi_square_z > 4 ? ": the model does not fit" : ""),
              check.chi_square_z);
}

/// Depth's uncertainty by the calibration where both cameras look, without matching.
void add_depth(const zoom_calibration &value, info_page *page) {
    json list = json::array();
    bool first = true;
    for (const double depth_mm : {1000.0, 1800.0, 3000.0, 10000.0}) {
        zoom_state state = middle_at(value, 0.5);
        double point_mm[3];
        zoom_point_ahead(&value, depth_mm, 0, point_mm);
        if (zoom_aim(&value, point_mm, &state, nullptr) != ERROR_OK) {
            continue;
        }
        zoom_pair pair;
        zoom_pair_at(value.camera, &state, &pair);
        const double middle_px[2] = {pair.side[0].lens.cx_px, pair.side[0].lens.cy_px};
        const zoom_variance variance = zoom_depth_variance(&value, &state, middle_px, depth_mm);
        const double lens_mm =
            std::sqrt(std::max(0.0, variance.lens + variance.mount + variance.cross));
        page->add("", first ? "depth uncertain by" : "",
                  number_text(std::sqrt(zoom_variance_sum(&variance)), 3) + " mm at " +
                      number_text(depth_mm, 5) + " mm: calibration " + number_text(lens_mm, 3) +
                      ", lens motors " + number_text(std::sqrt(variance.motor), 3) + ", servos " +
                      number_text(std::sqrt(variance.pan), 3),
                  nullptr);
        list.push_back({{"depth_mm", depth_mm},
                        {"sigma_mm", std::sqrt(zoom_variance_sum(&variance))},
                        {"calibration_mm", lens_mm},
                        {"motors_mm", std::sqrt(variance.motor)},
                        {"pan_mm", std::sqrt(variance.pan)}});
        first = false;
    }
    page->add("depth_sigma", "", "", list);
}

const char *unit_of(const std::string &axis) {
    if (axis == "distance") {
        return "mm";
    }
    return axis.find("pan") != std::string::npos ? "deg" : "counts";
}

/// The words of "key=number,...". False: the text is not such a list.
bool split_words(const std::string &text, std::map<std::string, double> *values) {
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find(',', begin), text.size());
        const std::string word = text.substr(begin, end - begin);
        const size_t equals = word.find('=');
        const std::string axis = word.substr(0, equals);
        command_number number;
        if (equals == std::string::npos ||
            command_words_quantity(word.c_str() + equals + 1, unit_of(axis), &number) !=
                COMMAND_QUANTITY_READ ||
            !values->emplace(axis, number.value).second) {
            return false;
        }
        begin = end + 1;
    }
    return true;
}

/// Takes the value of an axis of one side, or of both. False: it is not given.
bool take(std::map<std::string, double> *own, const std::map<std::string, double> &all, int side,
          const char *axis, double *value) {
    const std::string sided = std::string(sides[side]) + "_" + axis;
    const auto found = all.count(sided) != 0 ? all.find(sided) : all.find(axis);
    if (found == all.end()) {
        return false;
    }
    *value = found->second;
    own->erase(found->first);
    return true;
}

/// Pan angles: those given, else those that turn both cameras to the distance.
bool set_pans(const std::map<std::string, double> &all, const double *distance_mm,
              const zoom_calibration &value, std::map<std::string, double> *unused,
              zoom_state *state, std::string *message) {
    bool given = true;
    for (int side = 0; side < 2; side++) {
        double pan_deg = 0;
        given = take(unused, all, side, "pan", &pan_deg) && given;
        state->side[side].pan_rad = pan_deg / MATH_DEGREE_PER_RAD;
    }
    if (given) {
        return true;
    }
    if (distance_mm == nullptr) {
        *message = "pan is missing (or distance, for both)";
        return false;
    }
    double point_mm[3];
    zoom_point_ahead(&value, *distance_mm, 0, point_mm);
    if (zoom_aim(&value, point_mm, state, nullptr) != ERROR_OK) {
        *message = "the cameras cannot turn to that distance";
        return false;
    }
    return true;
}

/// Zoom and focus: those given, else focus for the distance.
bool set_lenses(const std::map<std::string, double> &all, const double *distance_mm,
                const zoom_calibration &value, std::map<std::string, double> *unused,
                zoom_state *state, std::string *message) {
    for (int side = 0; side < 2; side++) {
        auto &at = state->side[side];
        const bool zoom = take(unused, all, side, "zoom", &at.zoom_counts);
        const bool focus = take(unused, all, side, "focus", &at.focus_counts);
        if (!zoom || (!focus && distance_mm == nullptr)) {
            *message = std::string(sides[side]) + (zoom ? " focus" : " zoom") + " is missing";
            return false;
        }
        if (!focus) {
            at.focus_counts = zoom_focus_counts(&value.camera[side], at.zoom_counts, *distance_mm);
        }
    }
    return true;
}

bool by_words(const std::map<std::string, double> &all, const zoom_calibration &value,
              zoom_state *state, std::string *message) {
    std::map<std::string, double> unused = all;
    const auto distance = all.find("distance");
    const double *distance_mm = distance != all.end() ? &distance->second : nullptr;
    unused.erase("distance");
    if (distance_mm != nullptr && !(*distance_mm > 0)) {
        *message = "distance must be greater than 0";
        return false;
    }
    if (!set_lenses(all, distance_mm, value, &unused, state, message) ||
        !set_pans(all, distance_mm, value, &unused, state, message)) {
        return false;
    }
    if (!unused.empty()) {
        *message = "unknown axis \"" + unused.begin()->first +
                   "\" (expected zoom, focus, pan, those with left_ or right_, or distance)";
        return false;
    }
    return true;
}

struct wanted_pair {
    unsigned long number, count;  // 0: the last
    calibration_match_state state;
    bool found;
};

void take_pair(void *self, const session_pair_files *files) {
    auto *wanted = static_cast<wanted_pair *>(self);
    wanted->count++;
    if (wanted->number == 0 || wanted->count == wanted->number) {
        wanted->state = files->state;
        wanted->found = true;
    }
}

bool by_pair(const std::string &name, zoom_state *state, std::string *message) {
    std::string path = name;
    wanted_pair wanted{};
    const size_t colon = name.rfind(':');
    if (!session_pairs_here(path.c_str()) && colon != std::string::npos) {
        char *rest = nullptr;
        path = name.substr(0, colon);
        wanted.number = std::strtoul(name.c_str() + colon + 1, &rest, 10);
        if (*rest != '\0' || wanted.number == 0) {
            path = name;
        }
    }
    if (!session_pairs_here(path.c_str())) {
        *message =
            "neither axes (zoom=421,focus=540,pan=3.9) nor a session, SESSION or "
            "SESSION:NUMBER";
        return false;
    }
    struct message why {};
    if (session_pairs_read(path.c_str(), true, take_pair, &wanted, &why) < 0) {
        *message = why.text;
        return false;
    }
    if (!wanted.found) {
        *message = "no pair " + std::to_string(wanted.number) + " (the session has " +
                   std::to_string(wanted.count) + ")";
        return false;
    }
    const bool known = calibration_at_axes(&wanted.state, state, &why) == ERROR_OK;
    *message = known ? "" : why.text;
    return known;
}

}  // namespace

std::unique_ptr<zoom_calibration> info_zoom_read(const std::string &path, std::string *message) {
    const std::string head = info_head(path);
    if (!zoom_calibration_is_text(head.data(), head.size())) {
        return nullptr;
    }
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
    zoom_calibration *read = nullptr;
    struct message why {};
    if (calibration_read_zoom(path.c_str(), text.data(), text.size(), &read, &why) != ERROR_OK) {
        *message = why.text;
        return nullptr;
    }
    auto result = std::make_unique<zoom_calibration>(*read);
    std::free(read);
    return result;
}

info_page info_zoom(const std::string &path, const zoom_calibration &value) {
    info_page page;
    page.path = path;
    page.kind = "calibration of all zooms";
    page.add("id", "id", value.id, value.id);
    page.add("date", "date", *value.date != '\0' ? value.date : "unknown",
             *value.date != '\0' ? json(value.date) : json(nullptr));
    page.add("note", "note", *value.note != '\0' ? value.note : "-", value.note);
    page.add("instrument", "instrument", *value.instrument != '\0' ? value.instrument : "unknown",
             value.instrument);
    add_camera(value, 0, &page);
    add_camera(value, 1, &page);
    page.add("parameters", "parameters", std::to_string(value.parameters), value.parameters);
    add_checks(value, &page);
    add_depth(value, &page);
    return page;
}

bool info_zoom_state(const std::string &name, const zoom_calibration &value, zoom_state *state,
                     std::string *message) {
    std::map<std::string, double> words;
    *state = {};
    const bool listed = split_words(name, &words);
    const bool is_one =
        listed ? by_words(words, value, state, message) : by_pair(name, state, message);
    if (!is_one) {
        *message = "--at " + name + ": " + *message;
    }
    return is_one;
}
