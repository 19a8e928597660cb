// SPDX-License-Identifier: Apache-2.0
#include "tools/host/capture/capture_job.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "calib/detect/detect.hpp"
#include "core/error.h"
#include "core/math.h"
#include "daemon/base/message.h"
#include "daemon/cli/options.h"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/capture/capture_check.hpp"
#include "tools/host/capture/capture_directory.hpp"
#include "tools/host/capture/capture_instrument.hpp"
#include "tools/host/capture/capture_noise.hpp"
#include "tools/host/capture/capture_plan.hpp"
#include "tools/host/capture/capture_session.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

const int readings = 16;
// Frames for the corner noise; frames between two checks for motion.
const int stills = 30, first_stills = 5;
const int exit_interrupted = 130;
// Search for a distance that a lens can focus at: factor per step, largest factor in total.
const double nearest_step = 1.02, nearest_factor = 2;
const double aim_tolerance = 0.3;  // largest deviation, as a share of half the narrowest field
const double sweep_deg[] = {5, -5};
const char *const sides[2] = {"left", "right"};

class runner {
  public:
    explicit runner(const capture_job &job)
        : job_(job), session_(job.path, job.board), directory_(job.path) {}

    int run() {
        std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what to do next, also through a pipe
        const bool good = steps();
        std::string error;
        if (!session_.close(&error) && good) {
            error_ = error;
        }
        if (instrument_.interrupted()) {
            std::fprintf(stderr,
                         "vergence calibrate capture: interrupted; the pairs so far are in %s (the "
                         "same command continues)\n",
                         job_.path.c_str());
            return exit_interrupted;
        }
        if (!error_.empty()) {
            message text{};
            message_set(&text, 0, "%s", error_.c_str());
            std::fprintf(stderr, "vergence calibrate capture: %s\n", text.text);
            return CLIENT_BAD_INPUT;
        }
        return CLIENT_OK;
    }

  private:
    bool fail(const std::string &text) {
        error_ = text;
        return false;
    }

    bool command(const std::string &text) { return instrument_.run(text, &error_); }

    bool steps() {
        if (!directory_.check(&error_) || !session_.load(&error_) ||
            !instrument_.open(job_.address, job_.token, &error_) || !prepare() ||
            !directory_.make(&error_)) {
            return false;
        }
        uint32_t position = 0;
        for (const capture_shot &shot : session_.shots()) {
            position = std::max(position, static_cast<uint32_t>(shot.position));
        }
        planned_ = capture_places_before(optics_, zooms_, job_.board, session_.shots(),
                                         job_.near_mm, job_.far_mm);
        if (position > 0) {
            std::printf("%s has %zu pairs of %u positions\n", job_.path.c_str(),
                        session_.shots().size(), static_cast<unsigned>(position));
        }
        bool ended = false;
        while (!ended && static_cast<int>(position) < job_.positions) {
            if (!take_position(position + 1, &ended)) {
                return false;
            }
            position += !ended;
            say_rest(position, ended);
        }
        return finish();
    }

    void say_rest(uint32_t position, bool ended) const {
        const int left = job_.positions - static_cast<int>(position);
        if (!ended && left > 0) {
            std::printf("about %.0f minutes of the instrument's time for %d more positions\n",
                        capture_minutes(session_.shots()) / position * left, left);
        }
    }

    // ---- the instrument

    bool prepare() {
        std::string state, approach;
        if (!command("status") || !instrument_.text("state", &state)) {
            return error_.empty() ? fail("invalid answer from vergenced") : false;
        }
        double backlash = 0, pixel_um = 0;
        const std::pair<const char *, double *> settings[] = {
            {"lens_zoom_min", &optics_.zoom_min},
            {"lens_zoom_max", &optics_.zoom_max},
            {"lens_zoom_backlash", &backlash},
            {"focal_length_wide", &optics_.focal_wide_mm},
            {"focal_length_tele", &optics_.focal_tele_mm},
            {"focus_nearest", &optics_.focus_nearest_mm},
            {"pixel_pitch", &pixel_um},
            {"pan_min", &pan_limit_deg_[0]},
            {"pan_max", &pan_limit_deg_[1]},
        };
        bool good = (state == "ready" || command("bringup")) &&
                    instrument_.setting_text("rig.lens_zoom_approach", &approach, &error_);
        for (const auto &[key, value] : settings) {
            good = good && instrument_.setting(std::string("rig.") + key, value, &error_);
        }
        if (!good) {
            return false;
        }
        optics_.pixel_mm = pixel_um / 1000;
        optics_.f_number = job_.f_number;
        optics_.baseline_mm = job_.baseline_mm;
        // Beyond these there is no room to arrive from the side on which the play does not matter.
        const double first = optics_.zoom_min + (approach == "below" ? backlash : 0);
        const double last = optics_.zoom_max - (approach == "above" ? backlash : 0);
        zooms_ = capture_zooms(optics_, first, last, job_.zooms);
        std::printf("%d zooms from %.1f to %.1f mm\n", job_.zooms, optics_.focal_mm(zooms_.front()),
                    optics_.focal_mm(zooms_.back()));
        return prepare_cameras();
    }

    bool prepare_cameras() {
        double width = 0, height = 0;
        if (!command("window") || !set_whole_window()) {
            return false;
        }
        instrument_.number("width", &width);
        instrument_.number("height", &height);
        std::array<capture_window, 2> windows{};
        for (size_t side = 0; side < 2; side++) {
            // A camera with its own port has no window.
            instrument_.number(std::string(sides[side]) + ".column", &window_px_[side][0]);
            instrument_.number(std::string(sides[side]) + ".row", &window_px_[side][1]);
            windows[side] = {static_cast<int>(window_px_[side][0]),
                             static_cast<int>(window_px_[side][1]), static_cast<int>(width),
                             static_cast<int>(height)};
        }
        if (!session_.check_window(windows, &error_)) {
            return false;
        }
        optics_.width_px = static_cast<int>(width);
        optics_.height_px = static_cast<int>(height);
        // The servos get the angles at which they are, so that every pair states them.
        return command("iris f/" + number_text(job_.f_number, 4)) && read_pan() && turn(pan_deg_) &&
               check_lenses();
    }

    /// Only windows behind a bridge, which have a place, can be set to the whole sensor.
    bool set_whole_window() {
        const capture_optics whole;
        double width = 0, height = 0, column = 0;
        instrument_.number("width", &width);
        instrument_.number("height", &height);
        if (job_.keep_window || !instrument_.number("left.column", &column) ||
            (width == whole.width_px && height == whole.height_px)) {
            return true;
        }
        std::printf("window: %d x %d px, the whole sensor (it was %.0f x %.0f)\n", whole.width_px,
                    whole.height_px, width, height);
        return command(report_text_format("window %d %d", whole.width_px, whole.height_px)) &&
               command("window");
    }

    /// Drives both lenses to both ends, before anyone holds a board.
    bool check_lenses() {
        std::printf("checking the lenses: zoom and focus to both ends\n");
        return command("zoom " + std::to_string(zooms_.back())) && focus_by_scale(job_.far_mm) &&
               command("zoom " + std::to_string(zooms_.front())) && focus_by_scale(job_.near_mm);
    }

    bool read_pan() {
        return command("pan") && (instrument_.number("left", &pan_deg_[0]),
                                  instrument_.number("right", &pan_deg_[1]), true);
    }

    bool turn(const std::array<double, 2> &pan_deg) {
        std::array<double, 2> within = pan_deg;
        for (double &angle : within) {
            angle = std::clamp(angle, pan_limit_deg_[0], pan_limit_deg_[1]);
        }
        return command(report_text_format("pan %.3f right=%.3f", within[0], within[1])) &&
               read_pan();
    }

    // ---- pairs

    /// Takes a pair at a zoom, looks for the board, and leaves the pair in the hidden directory.
    /// `corners`: of both pictures, to focus by; null: focused at the measured distance.
    bool take(uint32_t position, int zoom, const capture_point *corners, capture_shot *shot) {
        double whites = 0;
        bool focused = false;
        if (!command("zoom " + std::to_string(zoom)) || !focus(corners, &focused) ||
            (!exposed_ && !command("autoexpose whites=yes iris=no")) || !see(shot, &whites) ||
            !expose_board(shot, &whites)) {
            return false;
        }
        exposed_ = true;
        if (!shot->moved.empty()) {
            return fail("the " + shot->moved +
                        " ring moved while a pair was taken, which was not kept (the same command "
                        "continues with a new position)");
        }
        shot->position = static_cast<int>(position);
        shot->focused = focused;
        captures_++;
        const std::string of = " of " + std::to_string(captures_planned_);
        std::printf("  %5.1f mm: %zu and %zu corners (captures %d%s)\n", optics_.focal_mm(zoom),
                    shot->view[0].corners.size(), shot->view[1].corners.size(), captures_,
                    captures_planned_ >= captures_ ? of.c_str() : "");
        return true;
    }

    /// Takes the pair again with another exposure if the board's white is not as it should be.
    bool expose_board(capture_shot *shot, double *whites) {
        const bool too_bright = *whites > CAPTURE_WHITES_MAX;
        const bool too_dark = *whites > 0 && *whites < CAPTURE_WHITES_MIN && !brightened_;
        if (!too_bright && !too_dark) {
            return true;
        }
        std::printf("  white at %.0f %%: exposed for the board\n", 100 * *whites);
        brightened_ = true;
        const capture_region region = capture_region_of(optics_, *shot, window_px_);
        std::string why;
        if (!instrument_.run(
                report_text_format("autoexpose whites=yes iris=no region=%d,%d,%d,%d", region.x_px,
                                   region.y_px, region.width_px, region.height_px),
                &why) &&
            (too_bright || instrument_.interrupted())) {
            return fail(why);
        }
        return see(shot, whites) &&
               (*whites <= CAPTURE_WHITES_MAX ||
                fail(report_text_format("the board's white is at %.0f %% of the range, and not at "
                                        "80 %% or less (avoid reflections on the board)",
                                        100 * *whites)));
    }

    /// Looks for the board; `*whites`: the brighter camera's.
    bool detect(capture_shot *shot, double *whites) {
        *whites = 0;
        for (size_t side = 0; side < 2; side++) {
            calibrate_image image;
            if (!calibrate_image_read(directory_.incoming() + "/" + shot->name[side], true, &image,
                                      &error_)) {
                return false;
            }
            const image_u8 grey = {image.grey.data(), image.width_px, image.height_px,
                                   image.width_px};
            shot->view[side] = calib::detect_board(job_.board, grey, {});
            *whites = std::max(*whites, capture_whites(job_.board, image, shot->view[side]));
        }
        session_.settle_layouts(shot);
        return true;
    }

    /// Takes a pair and looks for the board in it.
    bool see(capture_shot *shot, double *whites, int lens_readings = readings) {
        using clock = std::chrono::steady_clock;
        const clock::time_point begin = clock::now();
        const bool good = fetch_pair(shot, lens_readings) && detect(shot, whites);
        seconds_a_pair_ = std::chrono::duration<double>(clock::now() - begin).count();
        return good;
    }

    bool fetch_pair(capture_shot *shot, int lens_readings) {
        const bool good = directory_.renew(&error_) &&
                          command(report_text_format("capture %s readings=%d accept-mismatch=yes",
                                                     name_there_.c_str(), lens_readings)) &&
                          instrument_.fetch(name_there_, directory_.incoming(), &error_);
        // Also after an error or Ctrl-C: the name is ours.
        instrument_.discard(name_there_);
        return good && session_.look(directory_.incoming(), shot, &error_);
    }

    /// Focuses by the lens's scale, as near as both lenses can: what they have learned of their
    /// focus moves the nearest distance from that of the data sheet.
    bool focus_by_scale(double distance_mm) {
        const double nearest = std::max(distance_mm, optics_.focus_nearest_mm);
        std::string why;
        for (double at = nearest; at < nearest_factor * nearest; at *= nearest_step) {
            if (instrument_.run(report_text_format("focus %.0f mm", at), &why)) {
                return true;
            }
            if (why.find("out of range") == std::string::npos) {
                break;
            }
        }
        return fail(why);
    }

    /// `*focused`: on the board, by its corners; not by the scale.
    bool focus(const capture_point *corners, bool *focused) {
        const double distance = distance_mm_ > 0 ? distance_mm_ : next_.z_mm;
        if (!focus_by_scale(distance)) {
            return false;
        }
        for (size_t side = 0; side < 2 && corners != nullptr; side++) {
            std::string why;
            if (!autofocus(side, corners[side], &why)) {
                if (instrument_.interrupted()) {
                    return fail(why);
                }
                std::printf("  autofocus failed (%s): focused at the measured distance\n",
                            why.c_str());
                return focus_by_scale(distance);
            }
        }
        *focused = corners != nullptr;
        return true;
    }

    /// Regions are stated on the whole sensor.
    bool autofocus(size_t side, const capture_point &corner, std::string *why) {
        if (!instrument_.run(
                report_text_format("autofocus side=%s region=%s", sides[side],
                                   capture_focus_region(optics_, corner, window_px_[side]).c_str()),
                why)) {
            return false;
        }
        std::string verdict;
        instrument_.text(std::string(sides[side]) + ".verdict", &verdict);
        *why = sides[side] + (" camera: " + verdict);
        return verdict == "focused" || verdict == "sharp everywhere";
    }

    // ---- a position of the board

    /// Takes all pairs of a position. `*ended`: the user takes no more. False after an error.
    bool take_position(uint32_t position, bool *ended) {
        const capture_coverage covered = coverage();
        next_ = capture_next_place(optics_, zooms_, job_.board, covered, pan_deg_, job_.near_mm,
                                   job_.far_mm);
        distance_mm_ = 0;
        brightened_ = false;
        captures_ = captures_planned_ = 0;
        if (!draw(covered, &next_)) {
            return false;
        }
        std::printf("position %u of %d: %s%s\n", static_cast<unsigned>(position), job_.positions,
                    capture_place_text(next_).c_str(),
                    next_.aim ? "; the cameras will turn to it" : "");
        capture_shot wide;
        if (!find_board(position, &wide, ended) || *ended) {
            return *ended;
        }
        planned_.push_back(next_);
        return session_.add(directory_.incoming(), wide, &error_) && measure(wide) &&
               measure_noise() && aim(position, &wide) && take_zooms(position, wide) &&
               (!job_.sweep || take_sweep(position));
    }

    /// Asks for the board until both cameras see it at the widest zoom.
    bool find_board(uint32_t position, capture_shot *wide, bool *ended) {
        for (;;) {
            std::printf("place the board, then press Enter (q: end)\n");
            std::string line;
            const capture_instrument::answer answer = instrument_.ask(&line);
            *ended = answer != capture_instrument::answer::line || line == "q";
            if (*ended) {
                return true;
            }
            if (!take(position, zooms_[0], nullptr, wide)) {
                return false;
            }
            if (capture_is_seen(*wide)) {
                return true;
            }
            std::fputs(capture_not_seen(*wide).c_str(), stdout);
        }
    }

    /// The board's distance, from the widest zoom.
    bool measure(const capture_shot &wide) {
        capture_look look[2];
        for (size_t side = 0; side < 2; side++) {
            if (!capture_look_at(job_.board, wide.view[side], optics_.focal_px(zooms_[0]),
                                 &look[side])) {
                return fail("the corners of the board lie in one line");
            }
        }
        error_ = capture_check_sides(look);
        if (!error_.empty()) {
            return false;
        }
        distance_mm_ = 0.5 * (look[0].distance_mm + look[1].distance_mm);
        std::printf("  the board is %.0f mm away, tilted by %.0f deg\n", distance_mm_,
                    0.5 * (look[0].tilt_deg + look[1].tilt_deg));
        return true;
    }

    /// The noise of a corner, from still frames of the first board: of a few where it moves.
    bool measure_noise() {
        if (!job_.noise || session_.noise().frames > 0 || noise_tried_) {
            return true;
        }
        noise_tried_ = true;
        std::printf("  %d still frames for the corner noise: leave the board for about %.0f s\n",
                    stills, std::ceil(stills * seconds_a_pair_));
        std::vector<capture_still> views;
        session_corner_noise noise{};
        while (static_cast<int>(views.size()) < stills) {
            capture_shot shot;
            double whites = 0;
            if (!see(&shot, &whites, 1)) {
                return false;
            }
            views.push_back(shot.view);
            if (static_cast<int>(views.size()) % first_stills == 0 &&
                !capture_noise_of(views, &noise)) {
                std::printf("  the board moved or was covered: the corner noise stays unknown\n");
                return true;
            }
        }
        std::printf("  corner noise %.3f and %.3f px\n", noise.px[0], noise.px[1]);
        return session_.add_noise(noise, &error_);
    }

    /// Turns both cameras to the board, if that was planned and they are off.
    bool aim(uint32_t position, capture_shot *wide) {
        const double half_field =
            0.5 * optics_.width_px / optics_.focal_px(zooms_.back()) * MATH_DEGREE_PER_RAD;
        std::array<double, 2> pan_deg = pan_deg_;
        double off_deg = 0;
        for (size_t side = 0; side < 2 && next_.aim; side++) {
            capture_look look;
            capture_look_at(job_.board, wide->view[side], optics_.focal_px(zooms_[0]), &look);
            const double off =
                std::atan2(look.x_px - 0.5 * optics_.width_px, optics_.focal_px(zooms_[0])) *
                MATH_DEGREE_PER_RAD;
            pan_deg[side] += off;
            off_deg = std::max(off_deg, std::fabs(off));
        }
        if (off_deg <= aim_tolerance * half_field) {
            return true;
        }
        if (!turn(pan_deg)) {
            return false;
        }
        std::printf("  turned to %.2f and %.2f deg\n", pan_deg_[0], pan_deg_[1]);
        return take(position, zooms_[0], nullptr, wide) &&
               (capture_is_seen(*wide) ||
                fail("the board is no longer in view after the cameras turned "
                     "to it (was it moved?)")) &&
               session_.add(directory_.incoming(), *wide, &error_);
    }

    /// All longer zooms that still see enough of the board.
    bool take_zooms(uint32_t position, const capture_shot &wide) {
        capture_shot last = wide;
        size_t end = 1;
        while (end < zooms_.size() && visible(wide, zooms_[0], zooms_[end])) {
            end++;
        }
        captures_planned_ =
            captures_ + static_cast<int>(end) - 1 + (job_.sweep ? int(std::size(sweep_deg)) : 0);
        for (size_t i = 1; i < end; i++) {
            if (!visible(last, zooms_[i - 1], zooms_[i])) {
                break;
            }
            const double ratio = optics_.focal_mm(zooms_[i]) / optics_.focal_mm(zooms_[i - 1]);
            const capture_point corners[2] = {capture_middle_corner(optics_, last.view[0], ratio),
                                              capture_middle_corner(optics_, last.view[1], ratio)};
            capture_shot shot;
            if (!take(position, zooms_[i], is_longest(last, i, end) ? corners : nullptr, &shot)) {
                return false;
            }
            if (!capture_is_seen(shot)) {
                std::fputs(capture_not_seen(shot).c_str(), stdout);
                break;
            }
            error_ = capture_check_zoomed(optics_, last, shot, ratio);
            if (!error_.empty() || !session_.add(directory_.incoming(), shot, &error_)) {
                return false;
            }
            last = shot;
        }
        return true;
    }

    /// Whether the zoom after `last`'s is where the lenses are focused by their pictures: none that
    /// is longer shows the board.
    bool is_longest(const capture_shot &last, size_t zoom, size_t end) const {
        return job_.autofocus &&
               (zoom + 1 == end || !visible(last, zooms_[zoom - 1], zooms_[zoom + 1]));
    }

    bool visible(const capture_shot &shot, int from, int to) const {
        const double ratio = optics_.focal_mm(to) / optics_.focal_mm(from);
        return capture_corners_after_zoom(optics_, shot.view[0], ratio) >= CAPTURE_CORNERS_MIN &&
               capture_corners_after_zoom(optics_, shot.view[1], ratio) >= CAPTURE_CORNERS_MIN;
    }

    /// The board from other pans, at the widest zoom.
    bool take_sweep(uint32_t position) {
        const std::array<double, 2> home = pan_deg_;
        for (const double offset : sweep_deg) {
            capture_shot shot;
            if (!turn({home[0] + offset, home[1] + offset}) ||
                !take(position, zooms_[0], nullptr, &shot)) {
                return false;
            }
            if (capture_is_seen(shot) && !session_.add(directory_.incoming(), shot, &error_)) {
                return false;
            }
        }
        return turn(home);
    }

    // ---- what there is

    capture_coverage coverage() const {
        capture_coverage covered = capture_coverage_of(optics_, zooms_, session_.shots());
        covered.tried = planned_;
        return covered;
    }

    bool draw(const capture_coverage &covered, const capture_place *next) {
        return directory_.draw(
            capture_drawing(optics_, zooms_, job_.board, covered, next, pan_deg_), &error_);
    }

    bool finish() {
        const capture_coverage covered = coverage();
        int missing = 0;
        for (const auto &zoom : covered.zoom) {
            missing += std::min(zoom[0].boards, zoom[1].boards) < CAPTURE_BOARDS_WANTED;
        }
        std::printf("%s: %zu pairs in %.1f minutes of the instrument's time%s\n", job_.path.c_str(),
                    session_.shots().size(), capture_minutes(session_.shots()),
                    missing == 0 ? ""
                                 : report_text_format("; %d of %zu zooms have fewer than %d boards",
                                                      missing, zooms_.size(), CAPTURE_BOARDS_WANTED)
                                       .c_str());
        return draw(covered, nullptr);
    }

    const capture_job &job_;
    capture_instrument instrument_;
    capture_session session_;
    capture_directory directory_;
    const std::string name_there_ = "calibrate-capture-" + std::to_string(getpid());
    std::string error_;
    capture_optics optics_;
    std::vector<int> zooms_;
    std::array<double, 2> pan_deg_{}, pan_limit_deg_{};
    capture_windows window_px_{};  // positions on the sensors at which the frames begin
    capture_place next_;
    std::vector<capture_place> planned_;
    double distance_mm_ = 0, seconds_a_pair_ = 0;
    bool noise_tried_ = false;
    // Captures at this position, done and planned; 0: not known yet.
    int captures_ = 0, captures_planned_ = 0;
    bool exposed_ = false, brightened_ = false;  // exposed in this run; brightened at this position
};

}  // namespace

int capture_job_run(const capture_job &job) {
    return runner(job).run();
}
