// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_zoom.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "core/math.h"
#include "tools/host/calibrate/calibrate_result.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

const int zoom_solve_steps = 5;
const double pixel_mm = 0.0032;  // pixel pitch of the MT9T001
const double apart_counts = 20;
const int min_zooms = 4;

const calibration_axis &axis_of(const calibrate_shot &shot, size_t side, int axis) {
    return shot.state->origin.side[side].axis[axis];
}

bool is_known(const calibrate_shot &shot) {
    for (size_t side = 0; side < 2; side++) {
        for (const int axis : {CALIBRATION_ZOOM, CALIBRATION_FOCUS}) {
            if (axis_of(shot, side, axis).kind != CALIBRATION_AXIS_KNOWN) {
                return false;
            }
        }
    }
    return true;
}

/// The number of different positions.
int count_apart(std::vector<double> positions) {
    std::sort(positions.begin(), positions.end());
    int count = 0;
    double last = -INFINITY;
    for (const double one : positions) {
        if (one - last > apart_counts) {
            count++;
            last = one;
        }
    }
    return count;
}

/// Corners on the whole sensor.
calib::board_view on_sensor(const calib::board_view &view, const calibration_window &window) {
    calib::board_view result = view;
    for (calib::corner &corner : result.corners) {
        corner.x_px += window.column_px;
        corner.y_px += window.row_px;
    }
    return result;
}

class collector {
  public:
    explicit collector(calibrate_zoom_job *job) : job_(*job) {}

    bool run(std::string *error) {
        const std::vector<calibrate_shot> &shots = *job_.shots;
        calib::zoom_observations &seen = job_.seen;
        seen.boards = {job_.views->seen.target};
        seen.pixel_mm = {pixel_mm, pixel_mm};
        for (size_t i = 0; i < shots.size(); i++) {
            const calib::capture &capture = job_.views->seen.captures[i];
            if (capture.view[0].corners.empty() && capture.view[1].corners.empty()) {
                continue;
            }
            if (!fits(shots[i], error)) {
                return false;
            }
            add(i);
        }
        if (first_ == nullptr) {
            *error = "no picture with a usable board";
            return false;
        }
        seen.pan_sigma_rad =
            std::max(1e-6, first_->state->instrument.pan_repeatability_urad * 1e-6);
        return true;
    }

  private:
    /// The pair was taken with the same cameras as the first one.
    bool fits(const calibrate_shot &shot, std::string *error) {
        if (first_ == nullptr) {
            first_ = &shot;
        }
        const calibration_origin &a = first_->state->origin, &b = shot.state->origin;
        for (size_t side = 0; side < 2; side++) {
            const calibration_window &window = b.side[side].window;
            if (window.skip != 1) {
                *error = report_text_format(
                    "%s: skips pixels (skip %d): a calibration of all zooms needs every pixel",
                    shot.path[side].c_str(), window.skip);
                return false;
            }
            if (a.side[side].camera != std::string(b.side[side].camera) ||
                a.instrument != std::string(b.instrument)) {
                *error = report_text_format("%s: taken with another instrument or camera than %s",
                                            shot.path[side].c_str(), first_->path[side].c_str());
                return false;
            }
            job_.seen.width_px[side] =
                std::max(job_.seen.width_px[side], window.column_px + shot.state->width_px[side]);
            job_.seen.height_px[side] =
                std::max(job_.seen.height_px[side], window.row_px + shot.state->height_px[side]);
        }
        return true;
    }

    void add(size_t index) {
        const calibrate_shot &shot = (*job_.shots)[index];
        calib::capture one = job_.views->seen.captures[index];
        // The board stays where it is while the cameras turn.
        const size_t position = shot.board_position;
        one.position =
            number_of(&positions_, {shot.session, position, position > 0 ? 0 : index + 1});
        one.visit = number_of(&visits_, {shot.session, shot.pan_visit, 0});
        one.focused = shot.focused_on_board;
        for (size_t side = 0; side < 2; side++) {
            const calibration_axis &pan = axis_of(shot, side, CALIBRATION_PAN);
            one.axes[side] = {
                axis_of(shot, side, CALIBRATION_ZOOM).mean,
                axis_of(shot, side, CALIBRATION_FOCUS).mean,
                pan.kind == CALIBRATION_AXIS_KNOWN ? pan.mean * MATH_RAD_PER_DEGREE : 0};
            one.view[side] = on_sensor(one.view[side], shot.state->origin.side[side].window);
        }
        job_.seen.captures.push_back(one);
        job_.shot_of.push_back(index);
        job_.noise = shot.corner_noise.frames > 0 ? shot.corner_noise : job_.noise;
    }

    using key = std::array<size_t, 3>;

    static int number_of(std::vector<key> *known, const key &one) {
        const auto found = std::find(known->begin(), known->end(), one);
        if (found == known->end()) {
            known->push_back(one);
            return int(known->size()) - 1;
        }
        return int(found - known->begin());
    }

    calibrate_zoom_job &job_;
    const calibrate_shot *first_ = nullptr;
    std::vector<key> positions_, visits_;
};

uint32_t crc_of(const calib::zoom_observations &seen) {
    uint32_t crc = 0;
    for (const calib::capture &capture : seen.captures) {
        for (size_t side = 0; side < 2; side++) {
            for (const calib::corner &corner : capture.view[side].corners) {
                const double values[2] = {corner.x_px, corner.y_px};
                crc = crc_update(crc, values, sizeof values);
            }
        }
    }
    return crc;
}

/// The noise of a corner in both cameras.
double noise_px_of(const calibrate_zoom_job &job) {
    return std::hypot(job.noise.px[0], job.noise.px[1]) / std::sqrt(2.0);
}

/// What of the residuals is not the noise of corners.
double model_px_of(const calibrate_zoom_job &job) {
    const double noise_px = noise_px_of(job), rms_px = job.solution.rms_px;
    return std::sqrt(std::max(0.0, rms_px * rms_px - noise_px * noise_px));
}

/// "corner noise 0.03 px (30 still frames); ..." if it was measured, else "".
std::string noise_text(const calibrate_zoom_job &job) {
    if (job.noise.frames == 0) {
        return "";
    }
    const double model_px = model_px_of(job);
    return report_text_format("corner noise %.3f px (%u still frames of the first board); ",
                              noise_px_of(job), static_cast<unsigned>(job.noise.frames)) +
           (model_px > 0
                ? report_text_format("the rest of the residual, %.3f px, is the model", model_px)
                : "the residual is no larger");
}

}  // namespace

bool calibrate_zoom_is_wanted(const std::vector<calibrate_shot> &shots) {
    std::vector<double> positions[2];
    for (const calibrate_shot &shot : shots) {
        if (shot.state == nullptr || !is_known(shot)) {
            return false;
        }
        for (size_t side = 0; side < 2; side++) {
            positions[side].push_back(axis_of(shot, side, CALIBRATION_ZOOM).mean);
        }
    }
    return count_apart(positions[0]) >= min_zooms && count_apart(positions[1]) >= min_zooms;
}

bool calibrate_zoom_solve(calibrate_zoom_job *job, std::string *error) {
    if (!collector(job).run(error)) {
        return false;
    }
    calib::zoom_options options;
    options.threads = job->threads;
    options.paper = job->paper;
    int step = -1;
    std::string last;
    options.progress = [job, &step, &last](const char *what) {
        step += last == what ? 0 : 1;
        last = what;
        job->progress(std::min(step, zoom_solve_steps), zoom_solve_steps);
    };
    job->solution = calib::solve_zoom(job->seen, options);
    if (!job->solution.failure.empty()) {
        *error = job->solution.failure;
        return false;
    }
    zoom_calibration &rig = *job->solution.rig;
    const calibration_origin &origin = (*job->shots)[job->shot_of[0]].state->origin;
    const std::string made =
        report_text_format("zoom-%08x", static_cast<unsigned>(crc_of(job->seen)));
    std::snprintf(rig.id, sizeof rig.id, "%s", job->id.empty() ? made.c_str() : job->id.c_str());
    std::snprintf(rig.date, sizeof rig.date, "%s", job->date.c_str());
    std::snprintf(rig.note, sizeof rig.note, "%s",
                  job->solution.warnings.empty()
                      ? job->note.c_str()
                      : calibrate_not_good_note(job->solution.warnings[0], job->note).c_str());
    std::snprintf(rig.instrument, sizeof rig.instrument, "%s", origin.instrument);
    for (size_t side = 0; side < 2; side++) {
        std::snprintf(rig.camera[side].name, sizeof rig.camera[side].name, "%s",
                      origin.side[side].camera);
    }
    calibration_fault fault{};
    const int code = zoom_calibration_validate(&rig, &fault);
    if (code != ERROR_OK) {
        *error = "the calibration found cannot be used: " + calibration_file_explain(code, fault);
        return false;
    }
    if (!job->paper) {
        job->lengths = calib::lengths_of_zoom(job->solution, job->seen.boards[0]);
    }
    job->verdict = calib::zoom_verdict(job->solution, job->lengths);
    if (job->solution.warnings.empty() && job->noise.frames > 0) {
        job->verdict.back() = ';';
        job->verdict += " " + noise_text(*job) + ".";
    }
    return true;
}

std::vector<std::string> calibrate_zoom_notes(const calibrate_zoom_job &job) {
    const size_t max_corners = 10;
    std::vector<std::string> notes;
    std::vector<const calib::zoom_rejection *> corners;
    const auto line = [&](const calib::zoom_rejection &one) {
        return job.seen.captures[one.capture].name[size_t(one.camera)] + ": " + one.reason;
    };
    for (const calib::zoom_rejection &one : job.solution.rejections) {
        if (one.index < 0) {
            notes.push_back(line(one));
        } else {
            corners.push_back(&one);
        }
    }
    std::sort(corners.begin(), corners.end(),
              [](const auto *a, const auto *b) { return a->off_px > b->off_px; });
    for (size_t i = 0; i < corners.size() && i < max_corners; i++) {
        notes.push_back(line(*corners[i]) + " (corner " + std::to_string(corners[i]->index) + ")");
    }
    if (corners.size() > max_corners) {
        notes.push_back(report_text_format("%zu more corners were left out: see calibration.html",
                                           corners.size() - max_corners));
    }
    return notes;
}

std::string calibrate_zoom_file(const calibrate_zoom_job &job) {
    std::vector<char> text(ZOOM_TEXT_MAX_BYTES);
    const int length = zoom_calibration_print(job.solution.rig.get(), text.data(), text.size());
    INVARIANT(length > 0);  // it was validated
    return {text.data(), static_cast<size_t>(length)};
}

std::string calibrate_zoom_text(const calibrate_zoom_job &job) {
    const calib::zoom_solution &solution = job.solution;
    const zoom_validation &checked = solution.rig->validation;
    std::string text = report_text_format(
        "pictures    %d, a board in %d\nzooms       %d, %d board positions, %d corners\n",
        job.views->pictures, job.views->boards, checked.settings, checked.boards, checked.corners);
    for (size_t side = 0; side < 2; side++) {
        const zoom_camera &camera = solution.rig->camera[side];
        text += report_text_format("%-12sf %.0f to %.0f px at zoom %.1f to %.1f\n", side_name[side],
                                   std::exp(camera.log_focal.min), std::exp(camera.log_focal.max),
                                   camera.zoom.min, camera.zoom.max);
    }
    text += report_text_format("residuals   %.3f px rms, %d corners left out\n", solution.rms_px,
                               checked.rejected_corners);
    if (job.noise.frames > 0) {
        text += "noise       " + noise_text(job) + "\n";
    }
    if (checked.held_out_px > 0) {
        text += report_text_format("prediction  rows to %.2f px, f to %.3f %% at zooms left out\n",
                                   checked.held_out_px, 100 * checked.held_out_focal);
    }
    for (const calib::zoom_lengths &one : job.lengths) {
        const calib::zoom_expected &expected = one.expected;
        if (expected.read.length_mm > 0) {
            text += report_text_format(
                "length      %.0f mm at %.0f mm, f %.0f px: +- %.2g mm as read, %.2g with own "
                "matches",
                calib::EXPECTED_LENGTH_MM, one.distance_mm, one.focal_px, expected.read.length_mm,
                expected.own.length_mm);
            text += expected.board.length_mm > 0
                        ? report_text_format(", %.2g with the board\n", expected.board.length_mm)
                        : "\n";
        }
    }
    return text;
}

std::string calibrate_zoom_json(const calibrate_zoom_job &job) {
    using nlohmann::ordered_json;
    const zoom_calibration &rig = *job.solution.rig;
    ordered_json root;
    root["id"] = rig.id;
    root["zooms"] = rig.validation.settings;
    root["board_positions"] = rig.validation.boards;
    root["corners"] = rig.validation.corners;
    root["rms_px"] = job.solution.rms_px;
    root["noise_ratio"] = job.solution.noise_ratio;
    if (job.noise.frames > 0) {
        root["corner_noise"] = {{"left_px", job.noise.px[0]},
                                {"right_px", job.noise.px[1]},
                                {"frames", job.noise.frames},
                                {"model_px", model_px_of(job)}};
    }
    root["held_out_px"] = rig.validation.held_out_px;
    root["held_out_focal"] = rig.validation.held_out_focal;
    root["chi_square_z"] = rig.validation.chi_square_z;
    root["verdict"] = {{"good", job.solution.warnings.empty()},
                       {"sentence", job.verdict},
                       {"reasons", job.solution.warnings}};
    for (const calib::zoom_lengths &one : job.lengths) {
        root["length_sigma"].push_back({{"length_mm", calib::EXPECTED_LENGTH_MM},
                                        {"distance_mm", one.distance_mm},
                                        {"focal_px", one.focal_px},
                                        {"read_mm", one.expected.read.length_mm},
                                        {"own_mm", one.expected.own.length_mm},
                                        {"second_zoom_mm", one.expected.second.length_mm},
                                        {"board_mm", one.expected.board.length_mm}});
    }
    for (size_t side = 0; side < 2; side++) {
        ordered_json camera;
        for (const calib::zoom_setting &one : job.solution.settings) {
            ordered_json setting;
            setting["zoom_counts"] =
                job.solution.problem.side[side].settings[size_t(one.setting[side])];
            setting["solved_alone"] = one.alone[side].solved;
            if (one.alone[side].solved) {
                setting["alone_focal_px"] = one.alone[side].camera[0].fx_px;
                setting["alone_focal_sigma_px"] = one.alone[side].sigma.focal_px[0];
            }
            camera["settings"].push_back(setting);
        }
        root[side_name[side]] = camera;
    }
    return root.dump(2) + "\n";
}
