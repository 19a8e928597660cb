// SPDX-License-Identifier: Apache-2.0
/// Calibrations of libvergence: loaded, parsed, made from pictures, exported.
#include <sys/stat.h>

#include <algorithm>
#include <memory>

#include "console/pair/calibration_at.h"
#include "core/invariant.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "library/internal.hpp"
#include "stereo/geometry/geometry.h"
#include "tools/host/calibrate/calibrate_request.hpp"
#include "tools/host/calibrate/option_rows.hpp"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/convert/export.hpp"
#include "tools/host/info/info_zoom.hpp"

namespace {

struct load_request {
    int size_px[2], unit, first_camera;
    bool rectified;
    const char *at;
};

/// As `vergence info` has them.
const command_argument load_options[] = {
    number_option("size", COMMAND_INTEGER, offsetof(load_request, size_px), "WIDTHxHEIGHT",
                  "Size of the raw images.", 1, 32768, 2, 'x'),
    choice_option("unit", offsetof(load_request, unit), "UNIT", "Unit of length.", "mm cm m"),
    flag_option("rectified", offsetof(load_request, rectified), "Use the rectified cameras."),
    number_option("first-camera", COMMAND_INTEGER, offsetof(load_request, first_camera), "N",
                  "Number of the left camera.", 0, 8),
    text_option("at", offsetof(load_request, at), "STATE", "Of a calibration of all zooms."),
};

const option_page load_page = {"load_calibration",
                               "",
                               "",
                               "",
                               nullptr,
                               load_options,
                               sizeof load_options / sizeof *load_options,
                               0,
                               0};

/// The state of a calibration of all zooms; null with `message` empty: the file is something else.
int load_zoom(const std::string &path, const char *at, vergence_calibration **made,
              std::string *message) {
    const std::unique_ptr<zoom_calibration> zoom = info_zoom_read(path, message);
    if (zoom == nullptr) {
        return message->empty() ? ERROR_OK : ERROR_SYNTAX;
    }
    zoom_state state;
    calibration value;
    struct message why {};
    if (at == nullptr) {
        *message = path +
                   ": a calibration of all zooms: state the zoom, as in at=\"zoom=421,"
                   "distance=1800\"";
        return ERROR_MISSING;
    }
    if (!info_zoom_state(at, *zoom, &state, message)) {
        return ERROR_ARGUMENT;
    }
    const int error = calibration_at_state(zoom.get(), &state, "", &value, &why);
    if (error != ERROR_OK) {
        *message = path + ": " + why.text;
        return error;
    }
    calibration_fault fault{};
    const int settled = calibration_file_settle(&value, &fault);
    INVARIANT(settled == ERROR_OK);  // it was validated
    *made = library_calibration(value, "vergence", path);
    return ERROR_OK;
}

int load_other(const std::string &path, const load_request &asked, vergence_calibration **made,
               std::string *message) {
    static const char *const units[] = {"mm", "cm", "m"};
    import_options import;
    import.width_px = asked.size_px[0];
    import.height_px = asked.size_px[1];
    import.unit = asked.unit >= 0 ? units[asked.unit] : "";
    import.rectified = asked.rectified;
    import.first_camera = asked.first_camera;
    calibration value;
    calibration_file_report report;
    const int error = calibration_file_load(path, import, &value, &report, message);
    if (error == ERROR_OK) {
        *made = library_calibration(value, report.format, path);
        (*made)->notes = report.assumed;
    }
    return error;
}

int load(const std::string &path, const char *const *options, vergence_calibration **made,
         std::string *text) {
    load_request asked = {{0, 0}, -1, -1, false, nullptr};
    library_words words("load_calibration");
    words.add(options);
    int operands = 0;
    message line{};
    if (options_read(&load_page, words.count(), words.values(), &asked, nullptr, &operands,
                     &line) != ERROR_OK) {
        *text = line.text;
        return ERROR_ARGUMENT;
    }
    struct stat status;
    const bool is_file = stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
    const int error = is_file ? load_zoom(path, asked.at, made, text) : ERROR_OK;
    if (error != ERROR_OK || *made != nullptr) {
        return error;
    }
    return load_other(path, asked, made, text);
}

int code_of_exit(int exit_code) {
    if (exit_code == CLIENT_FAILED) {
        return ERROR_IO;
    }
    return exit_code == CLIENT_USAGE ? ERROR_ARGUMENT : ERROR_MISSING;
}

vergence_lens lens_of(lens_kind kind) {
    switch (kind) {
        case LENS_RATIONAL:
            return VERGENCE_RATIONAL;
        case LENS_EQUIDISTANT:
            return VERGENCE_EQUIDISTANT;
        default:
            return VERGENCE_BROWN_CONRADY;
    }
}

bool stop_calibrating(void *self) {
    return static_cast<const library_watch *>(self)->should_stop();
}

int calibrate(const char *const *words, const vergence_observer *observer,
              vergence_calibration **made, vergence_error *error) {
    library_words line("calibrate");
    line.add(words);
    calibrate_job job;
    std::string text;
    const int refused = calibrate_request_read(line.count(), line.values(), &job, &text);
    if (refused != CLIENT_OK) {
        return library_fail(error, code_of_exit(refused), text);
    }
    library_watch watch(observer);
    job.expect = [&watch](const double *work, int stages) { watch.expect(work, stages); };
    job.progress = [&watch](int stage, const char *what, int done, int total) {
        watch.show(stage, what, done, total);
    };
    interrupt_ask(stop_calibrating, &watch);
    calibrate_outcome outcome;
    try {
        outcome = calibrate_job_run(job);
    } catch (...) {
        interrupt_ask(nullptr, nullptr);
        throw;
    }
    interrupt_ask(nullptr, nullptr);
    if (outcome.code != CLIENT_OK && outcome.code != CLIENT_NOT_GOOD) {
        return library_fail(error,
                            outcome.interrupted ? int(ERROR_CANCELLED) : code_of_exit(outcome.code),
                            outcome.message);
    }
    if (job.single || job.verify || !outcome.zoom_text.empty()) {
        return library_fail(error, ERROR_UNSUPPORTED,
                            "not the calibration of one pair of cameras at one zoom: use "
                            "\"vergence calibrate\"");
    }
    *made = library_calibration(outcome.rig, "vergence", "calibration");
    (*made)->good = outcome.code == CLIENT_OK;
    (*made)->verdict = outcome.message;
    (*made)->json = outcome.json;
    (*made)->notes = outcome.notes;
    return ERROR_OK;
}

}  // namespace

vergence_calibration *library_calibration(const calibration &value, const std::string &format,
                                          const std::string &path) {
    auto made = std::make_unique<vergence_calibration>();
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&value, text, sizeof text);
    INVARIANT(length > 0);  // it was rounded and validated
    made->value = value;
    made->text.assign(text, static_cast<size_t>(length));
    made->format = format;
    made->path = path;
    return made.release();
}

int vergence_calibration_load(const char *path, const char *const *options,
                              vergence_calibration **made, vergence_error *error) {
    return library_guard(error, [&] {
        std::string text;
        vergence_calibration *loaded = nullptr;
        const int code = load(path, options, &loaded, &text);
        if (code != ERROR_OK) {
            return library_fail(error, code, text);
        }
        *made = loaded;
        return code;
    });
}

int vergence_calibration_parse(const char *text, size_t length, vergence_calibration **made,
                               vergence_error *error) {
    return library_guard(error, [&] {
        calibration value{};
        calibration_fault fault{};
        const int code = calibration_parse(text, length, &value, &fault);
        if (code != ERROR_OK) {
            return library_fail(error, code,
                                "the calibration: " + calibration_file_explain(code, fault));
        }
        *made = library_calibration(value, "vergence", "calibration");
        return code;
    });
}

int vergence_calibrate(const char *const *words, const vergence_observer *observer,
                       vergence_calibration **made, vergence_error *error) {
    return library_guard(error, [&] { return calibrate(words, observer, made, error); });
}

void vergence_calibration_free(vergence_calibration *one) {
    delete one;
}

const char *vergence_calibration_text(const vergence_calibration *one) {
    return one->text.c_str();
}

const char *vergence_calibration_format(const vergence_calibration *one) {
    return one->format.c_str();
}

int vergence_calibration_is_good(const vergence_calibration *one) {
    return one->good ? 1 : 0;
}

const char *vergence_calibration_verdict(const vergence_calibration *one) {
    return one->verdict.c_str();
}

const char *vergence_calibration_json(const vergence_calibration *one) {
    return one->json.c_str();
}

const char *vergence_calibration_note(const vergence_calibration *one, size_t number) {
    return number < one->notes.size() ? one->notes[number].c_str() : nullptr;
}

void vergence_calibration_camera(const vergence_calibration *one, int side,
                                 vergence_camera *camera) {
    const lens &from = side == 0 ? one->value.left : one->value.right;
    *camera = {from.width_px, from.height_px, from.fx_px,         from.fy_px,
               from.cx_px,    from.cy_px,     lens_of(from.kind), {}};
    const std::vector<double> values = export_coefficients(from);
    std::copy(values.begin(), values.end(), camera->coefficients);
}

void vergence_calibration_pose(const vergence_calibration *one, double R[9], double t_mm[3]) {
    geometry_rotation_from_vector(one->value.rotation_right_left_rad, R);
    std::copy_n(one->value.translation_right_left_mm, 3, t_mm);
}

int vergence_calibration_rectify(const vergence_calibration *one, vergence_rectified *rectified,
                                 vergence_error *error) {
    export_rectified made;
    const int code = export_rectify(one->value, &made);
    if (code != ERROR_OK) {
        return library_fail(error, code, error_text(code));
    }
    std::copy_n(made.R_rect_left, 9, rectified->R1);
    std::copy_n(made.R_rect_right, 9, rectified->R2);
    export_projections(made, 1, rectified->P1, rectified->P2);
    return ERROR_OK;
}

int vergence_calibration_save(const vergence_calibration *one, const char *path,
                              vergence_error *error) {
    return library_guard(error, [&] {
        std::string text;
        const int code = calibration_file_write(path, one->value, &text);
        return code == ERROR_OK ? code : library_fail(error, code, text);
    });
}

int vergence_calibration_export(const vergence_calibration *one, const char *format,
                                const char *directory, vergence_error *error) {
    return library_guard(error, [&] {
        std::vector<std::string> paths;
        std::string loss, text;
        const int code = export_write(one->value, format, directory, &paths, &loss, &text);
        return code == ERROR_OK ? code : library_fail(error, code, "cannot export: " + text);
    });
}
