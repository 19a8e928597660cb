// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_job.hpp"

#include <glog/logging.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <sstream>

#include "calib/solve/solve.hpp"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/base/monotonic.h"
#include "daemon/base/process.h"
#include "daemon/base/workers.h"
#include "daemon/cli/options.h"
#include "daemon/files/atomic_dir.h"
#include "daemon/files/output_file.h"
#include "stereo/geometry/geometry.h"
#include "tools/host/calibrate/calibrate_mirror.hpp"
#include "tools/host/calibrate/calibrate_result.hpp"
#include "tools/host/calibrate/calibrate_touch_up.hpp"
#include "tools/host/calibrate/calibrate_views.hpp"
#include "tools/host/calibrate/calibrate_zoom.hpp"
#include "tools/host/calibration_report/calibration_report.hpp"
#include "tools/host/calibration_report/zoom_report.hpp"

namespace {

enum { STAGE_DETECT, STAGE_SOLVE, STAGE_WRITE, STAGES };

const int solve_steps = 5;
// Weights of the progress stages: a picture's corners, the solution for one picture, the files.
const double detect_work = 3, solve_work = 2, write_work = 4;

const char *const result_names[] = {"rig.calibration", "instrument.zoom", "corners.vnl",
                                    "calibration.html", "calibration.json"};
const int result_count = sizeof result_names / sizeof result_names[0];

/// Thrown from the solver's progress call after Ctrl-C.
struct interrupted {};

struct workers_closer {
    void operator()(workers *pool) const { workers_destroy(pool); }
};

/// Removes the hidden directory unless the results were moved into place.
struct atomic_dir_guard {
    atomic_dir directory{};
    atomic_dir_guard() { directory.lock_fd = -1; }
    ~atomic_dir_guard() { atomic_dir_abort(&directory); }
    atomic_dir_guard(const atomic_dir_guard &) = delete;
    atomic_dir_guard &operator=(const atomic_dir_guard &) = delete;
};

class runner {
  public:
    explicit runner(const calibrate_job &job) : job_(job) {}

    calibrate_outcome run() {
        // The verdict reports what Ceres would log about invalid numbers.
        FLAGS_minloglevel = google::GLOG_FATAL;
        start_us_ = monotonic_now_us();
        calibrate_outcome outcome;
        try {
            outcome.code = steps();
        } catch (const interrupted &) {
            outcome.interrupted = true;
            outcome.code = CLIENT_FAILED;
            message_ = "interrupted; nothing was written";
        }
        outcome.message = outcome.code != CLIENT_OK ? message_ : solution_.verdict.sentence;
        const bool solved = outcome.code == CLIENT_OK || outcome.code == CLIENT_NOT_GOOD;
        outcome.notes = solved ? all_notes() : reasons_;
        if (solved) {
            outcome.rig = result_.rig;
            outcome.zoom_text = zoom_file_;
            outcome.json = json_;
            outcome.text = summary();
        }
        return outcome;
    }

  private:
    int fail(int code, const std::string &text) {
        message_ = text;
        return code;
    }

    /// Any thread; a caller's own question is asked on the thread of the run alone.
    bool is_stopped() {
        if (interrupt_requested()) {
            stopped_ = true;
        }
        return stopped_;
    }

    void show(int stage, const char *what, int done, int total) const {
        if (job_.progress) {
            job_.progress(stage, what, done, total);
        }
    }

    void stop_if_interrupted() {
        if (is_stopped()) {
            throw interrupted{};
        }
    }

    int begin() {
        message last_error{};
        threads_.reset(workers_create(job_.threads));
        if (threads_ == nullptr) {
            return fail(CLIENT_FAILED, "out of memory for threads");
        }
        const bool zooms = is_at_many_zooms() && job_.zoom.empty();
        if (zooms && job_.distortion) {
            return fail(
                CLIENT_BAD_INPUT,
                "--model: lenses at all zooms have k1 k2 p1 p2: omit it, or name the pictures "
                "of one zoom");
        }
        std::vector<const char *> names(result_names + 2, result_names + result_count);
        names.insert(names.end(), job_.single ? 0 : 1, result_names[zooms ? 1 : 0]);
        if (writes() && atomic_dir_begin(&out_.directory, job_.out_path.c_str(), names.data(),
                                         static_cast<int>(names.size()), &last_error) != ERROR_OK) {
            return fail(CLIENT_FAILED, last_error.text);
        }
        return CLIENT_OK;
    }

    bool writes() const { return !job_.verify && !job_.out_path.empty(); }

    int steps() {
        const int begun = begin();
        if (begun != CLIENT_OK) {
            return begun;
        }
        if (!job_.zoom.empty()) {
            return touch_up_steps();
        }
        find_views();
        if (!have_enough()) {
            return CLIENT_BAD_INPUT;
        }
        if (is_at_many_zooms()) {
            return zoom_steps();
        }
        if (is_plainly_mirrored()) {
            return fail(CLIENT_BAD_INPUT, mirrored_text());
        }
        solve();
        set_result();
        if (!solution_.solved) {
            reasons_ = calibrate_result_rejections(result_);
            const std::string fault = fault_text();
            return fail(CLIENT_BAD_INPUT,
                        !fault.empty() ? fault : solution_.verdict.sentence + hint_for_unsolved());
        }
        assess();
        if (!describe_rig()) {
            return CLIENT_BAD_INPUT;
        }
        json_ = calibrate_result_json(result_);
        const int code = write_pair();
        if (code != CLIENT_OK || solution_.verdict.good) {
            return code;
        }
        return fail(CLIENT_NOT_GOOD, solution_.verdict.sentence);
    }

    void set_result() {
        result_.views = &views_;
        result_.solution = &solution_;
        result_.notes = job_.inputs.notes;
        for (const std::string &line : calibrate_result_overexposed(result_)) {
            result_.notes.push_back(line);
        }
        if (const std::string layout = calibrate_result_layout(result_); !layout.empty()) {
            result_.notes.push_back(layout);
        }
    }

    bool is_at_many_zooms() const {
        return !job_.single && calibrate_zoom_is_wanted(job_.inputs.shots);
    }

    /// Looks at the board with a calibration of all zooms; the last pair's is written.
    int touch_up_steps() {
        std::vector<touch_up_look> looks;
        if (job_.board.columns == 0) {
            views_ = touch_up_views(job_.marks, job_.inputs.shots);
        } else {
            find_views();
            if (!have_enough()) {
                return CLIENT_BAD_INPUT;
            }
        }
        if (!calibrate_touch_up(job_.zoom, job_.inputs.shots, views_, job_.marks, !job_.verify,
                                &looks, &result_.notes, &message_)) {
            return CLIENT_BAD_INPUT;
        }
        const double square_mm = views_.seen.target.square_mm;
        zoom_text_ = touch_up_text(looks, !job_.verify);
        json_ = touch_up_json(looks, square_mm, !job_.verify);
        const touch_up_outcome outcome = touch_up_verdict(looks, square_mm, !job_.verify);
        solution_.verdict.sentence = outcome.sentence;
        solution_.verdict.good = outcome.good;
        if (!job_.verify) {
            result_.rig = looks.back().rig;
            if (!outcome.good) {
                std::snprintf(result_.rig.note, sizeof result_.rig.note, "%s",
                              calibrate_not_good_note(outcome.reason, job_.note).c_str());
            }
            const int code =
                write_results({{"rig.calibration", rig_text()},
                               {"corners.vnl", job_.board.columns > 0 ? corners_text() : ""}});
            if (code != CLIENT_OK) {
                return code;
            }
        }
        return outcome.good ? CLIENT_OK : fail(CLIENT_NOT_GOOD, outcome.sentence);
    }

    /// All zooms of a rig at once.
    int zoom_steps() {
        calibrate_zoom_job zoom;
        zoom.shots = &job_.inputs.shots;
        zoom.views = &views_;
        zoom.threads = workers_parallel(threads_.get())->threads;
        zoom.id = job_.id;
        zoom.date = job_.date;
        zoom.note = job_.note;
        zoom.paper = job_.paper;
        zoom.progress = [this](int step, int steps) {
            stop_if_interrupted();
            show(STAGE_SOLVE, "solve", step, steps);
        };
        if (!calibrate_zoom_solve(&zoom, &message_)) {
            return CLIENT_BAD_INPUT;
        }
        stop_if_interrupted();
        zoom_text_ = calibrate_zoom_text(zoom);
        json_ = calibrate_zoom_json(zoom);
        show(STAGE_WRITE, "write", 0, 1);
        for (const std::string &line : calibrate_zoom_notes(zoom)) {
            result_.notes.push_back(line);
        }
        solution_.verdict.sentence = zoom.verdict;
        solution_.verdict.good = zoom.solution.warnings.empty();
        zoom_file_ = calibrate_zoom_file(zoom);
        const int code = write_results(
            {{"instrument.zoom", zoom_file_},
             {"corners.vnl", corners_text()},
             {"calibration.html", zoom_report({&zoom.seen, &zoom.solution, zoom.verdict})}});
        return code == CLIENT_OK && !solution_.verdict.good
                   ? fail(CLIENT_NOT_GOOD, solution_.verdict.sentence)
                   : code;
    }

    /// Origin, id and notes of the rig; false with `message_` set when it cannot be used.
    bool describe_rig() {
        if (!job_.single &&
            !calibrate_origin_of(job_.inputs.shots, solution_, &result_.rig.origin, &message_)) {
            return false;
        }
        for (const std::string &line :
             calibrate_origin_notes(job_.inputs.shots, result_.rig.origin)) {
            result_.notes.push_back(line);
        }
        if (job_.single || calibrate_rig_name(job_.id, job_.date, job_.note, &result_, &message_)) {
            return true;
        }
        if (const std::string fault = fault_text(); !fault.empty()) {
            message_ = fault;
        }
        return false;
    }

    void find_views() {
        calibrate_views_request request;
        request.board = job_.board;
        request.single = job_.single;
        request.cache = job_.cache;
        request.threads = workers_parallel(threads_.get());
        request.cancelled = [this] { return is_stopped(); };
        request.progress = [this](int done, int total) {
            show(STAGE_DETECT, "detect", done, total);
        };
        double pictures = 0;
        for (const calibrate_shot &shot : job_.inputs.shots) {
            pictures += !shot.path[0].empty() + !shot.path[1].empty();
        }
        const double work[STAGES] = {detect_work * pictures, solve_work * pictures, write_work};
        if (job_.expect) {
            job_.expect(work, STAGES);
        }
        views_ = calibrate_views_find(job_.inputs.shots, request);
        stop_if_interrupted();
    }

    /// Reports what is missing in one line, before the solver would.
    bool have_enough() {
        message_ = calibrate_rejection_text(views_);
        if (message_.empty()) {
            return true;
        }
        result_.views = &views_;
        result_.solution = &solution_;
        reasons_ = calibrate_result_rejections(result_);
        if (reasons_.size() <= 1) {
            reasons_.clear();  // reported by the message
        }
        return false;
    }

    void solve() {
        calib::solve_options options;
        options.threads = workers_parallel(threads_.get())->threads;
        options.distortion = job_.distortion;
        int step = -1;
        std::string last;
        options.progress = [this, &step, &last](const char *what) {
            stop_if_interrupted();
            step += last == what ? 0 : 1;
            last = what;
            show(STAGE_SOLVE, "solve", std::min(step, solve_steps), solve_steps);
        };
        solution_ = calib::solve(views_.seen, options);
        stop_if_interrupted();
    }

    bool is_plainly_mirrored() {
        return calibrate_one_camera_mirrors_at_a_glance(
            views_.seen, workers_parallel(threads_.get())->threads,
            [this](const char *) { stop_if_interrupted(); });
    }

    /// What is wrong with the pairs; "" when it is not their left and right pictures' fault. Only
    /// when few pairs fit together, or badly.
    const std::string &fault_text() {
        if (!fault_known_ && !calibrate_pairs_fit(solution_, views_.pairs)) {
            const calibrate_pair_fault fault =
                calibrate_find_pair_fault(views_.seen, workers_parallel(threads_.get())->threads,
                                          [this](const char *) { stop_if_interrupted(); });
            stop_if_interrupted();
            fault_known_ = true;
            if (fault == calibrate_pair_fault::one_mirrors) {
                fault_ = mirrored_text();
            } else if (fault == calibrate_pair_fault::apart) {
                fault_ = apart_text();
            }
        }
        return fault_;
    }

    static std::string apart_text() {
        return "each camera's pictures fit alone, but most left and right ones do not show the "
               "board at the same place: hold board and cameras still while both are taken, or "
               "take both at the same moment, and check that the right files are paired";
    }

    static std::string mirrored_text() {
        return "the pictures of one camera only are mirrored: switch mirroring off "
               "(webcam previews do it) and take them again";
    }

    /// Before all others, unless one of those may be its cause.
    void add_reason(const std::string &reason, bool first = true) {
        calib::verdict &verdict = solution_.verdict;
        verdict.good = false;
        if (!first) {
            verdict.reasons.push_back(reason);
            return;
        }
        verdict.reasons.insert(verdict.reasons.begin(), reason);
        verdict.sentence = "Not good: " + reason + ".";
    }

    std::string hint_for_unsolved() const {
        const bool few = views_.pictures - static_cast<int>(views_.rejections.size()) < 10;
        return few ? " Photograph the board in about fifteen positions, tilted in different "
                     "directions."
                   : "";
    }

    /// Adds to the verdict what the solver cannot know.
    void assess() {
        if (job_.single) {
            return;
        }
        result_.rows = calibrate_rows_of(solution_);
        // From the right camera to the left one, in the left frame: if the right camera is mounted
        // upside down, its own frame would have the opposite sign.
        double back_mm[3];
        geometry_rotate_back(solution_.T_right_left.R, solution_.T_right_left.t_mm, back_mm);
        if (back_mm[0] > 0 && back_mm[0] > std::abs(back_mm[1])) {
            add_reason(
                "the right camera is to the left of the left one: left and right are swapped "
                "(exchange them in the files' names, or name the right folder or pattern first), "
                "or the pictures are mirrored (switch mirroring off) or upside down (turn them)");
        }
        if (!fault_text().empty()) {
            const bool apart = fault_text() == apart_text();
            add_reason(fault_text(), !apart || !solution_.verdict.lens_outside_model);
        }
    }

    int write_file(const char *name, const std::string &text) {
        char path[ATOMIC_DIR_PATH_BYTES];
        atomic_dir_file_path(&out_.directory, name, path);
        const auto file = std::make_unique<output_file>();
        output_file_open(file.get(), path);
        output_file_write(file.get(), text.data(), text.size());
        message last_error{};
        const int code = output_file_close(file.get(), &last_error);
        stop_if_interrupted();
        if (code != ERROR_OK) {
            atomic_dir_name_final(&out_.directory, &last_error);
            return fail(CLIENT_FAILED, last_error.text);
        }
        return CLIENT_OK;
    }

    /// Empty when a name cannot be written to such a file; a note reports that.
    std::string corners_text() {
        std::vector<calib::cached_view> views;
        for (const calib::capture &capture : views_.seen.captures) {
            for (size_t camera = 0; camera < 2; camera++) {
                if (!capture.name[camera].empty()) {
                    views.push_back({capture.name[camera], capture.view[camera]});
                }
            }
        }
        std::ostringstream out;
        std::string error;
        if (!calib::corner_cache_write(out, job_.board, views, &error)) {
            result_.notes.push_back("corners.vnl is not written: " + error);
            return "";
        }
        return out.str();
    }

    std::string rig_text() const {
        char text[CALIBRATION_TEXT_MAX_BYTES];
        const int length = calibration_print(&result_.rig, text, sizeof text);
        INVARIANT(length > 0);  // it was rounded and validated
        return std::string(text, static_cast<size_t>(length));
    }

    std::string page_text() {
        calibration_page page{};
        page.seen = &views_.seen;
        page.result = &solution_;
        page.title = job_.single ? "One camera" : result_.rig.id;
        page.load = [this](size_t shot, int camera, std::vector<uint8_t> *grey, int *width,
                           int *height) {
            calibrate_image image;
            std::string error;
            const calibrate_shot &one = job_.inputs.shots[shot];
            const std::string &path = one.path[static_cast<size_t>(camera)];
            if (path.empty() || !calibrate_image_read(path, one.mosaic, &image, &error)) {
                return false;
            }
            calibrate_image_enlarge(&image);
            grey->swap(image.grey);
            *width = image.width_px;
            *height = image.height_px;
            return true;
        };
        std::ostringstream out;
        const bool written = calibration_report_write(page, out);
        INVARIANT(written);  // writing into memory cannot fail
        return out.str();
    }

    using named_texts = std::vector<std::pair<const char *, std::string>>;

    int write_pair() {
        show(STAGE_WRITE, "write", 0, 1);
        if (!writes()) {
            return CLIENT_OK;
        }
        return write_results({{"rig.calibration", job_.single ? "" : rig_text()},
                              {"corners.vnl", corners_text()},
                              {"calibration.html", page_text()}});
    }

    /// Writes all that are not empty, and calibration.json.
    int write_results(const named_texts &files) {
        int code = CLIENT_OK;
        if (!writes()) {
            return code;
        }
        for (const auto &[name, text] : files) {
            code = code == CLIENT_OK && !text.empty() ? write_file(name, text) : code;
        }
        if (code == CLIENT_OK) {
            code = write_file("calibration.json", json_);
        }
        if (code != CLIENT_OK) {
            return code;
        }
        message last_error{};
        if (atomic_dir_commit(&out_.directory, result_names, result_count, "calibration.json",
                              &last_error) != ERROR_OK) {
            return fail(CLIENT_FAILED, last_error.text);
        }
        return CLIENT_OK;
    }

    std::vector<std::string> all_notes() const {
        std::vector<std::string> notes = result_.notes;
        const std::vector<std::string> &remarks = solution_.verdict.remarks;
        notes.insert(notes.end(), remarks.begin(), remarks.end());
        if (zoom_text_.empty()) {
            const std::vector<std::string> left_out = calibrate_result_rejections(result_);
            notes.insert(notes.end(), left_out.begin(), left_out.end());
        }
        return notes;
    }

    std::string summary() const {
        const double seconds = static_cast<double>(monotonic_now_us() - start_us_) / 1e6;
        char cost[64];
        std::snprintf(cost, sizeof cost, "cost        %.2f s, %d threads\n", seconds,
                      workers_parallel(threads_.get())->threads);
        return (zoom_text_.empty() ? calibrate_result_text(result_) : zoom_text_) + cost +
               (writes() ? "results     " + job_.out_path + "\n" : "") +
               (solution_.verdict.good ? solution_.verdict.sentence + "\n" : "");
    }

    const calibrate_job &job_;
    std::atomic<bool> stopped_{false};
    uint64_t start_us_ = 0;
    atomic_dir_guard out_;
    std::unique_ptr<workers, workers_closer> threads_;
    calibrate_views views_;
    calib::solution solution_;
    calibrate_result result_{};
    std::string json_, message_;
    std::string zoom_text_;  // not empty: all zooms were solved
    std::string zoom_file_;  // the calibration of all zooms
    bool fault_known_ = false;
    std::string fault_;
    std::vector<std::string> reasons_;  // extra detail for the message
};

}  // namespace

calibrate_outcome calibrate_job_run(const calibrate_job &job) {
    return runner(job).run();
}
