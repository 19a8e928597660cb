// SPDX-License-Identifier: Apache-2.0
#include "tools/host/convert/calibration_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "console/pair/calibration_at.h"
#include "core/crc.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/files/input_file.h"
#include "daemon/surface/length_check.h"
#include "stereo/geometry/calibration_grammar.h"
#include "tools/host/formats/numpy_archive.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace {

const size_t file_limit_bytes = 16u << 20;

bool exists(const std::string &path) {
    return access(path.c_str(), F_OK) == 0;
}

[[noreturn]] void fail(int code, const std::string &message) {
    throw import_failure{code, message};
}

import_file read_file(const std::string &path) {
    import_file file{path, {}};
    std::string message;
    const int error =
        whole_file_read(path, file_limit_bytes, "a calibration file", &file.text, &message);
    if (error != ERROR_OK) {
        fail(error, message);
    }
    if (file.text.empty()) {
        fail(ERROR_SYNTAX, path + ": empty file");
    }
    return file;
}

/// `path` with the last `from` in it replaced by `to`, or "" when it has none: in its file name, or
/// else in the directories (cam0/sensor.yaml).
std::string partner_name(const std::string &path, const std::string &from, const std::string &to) {
    const size_t at = path.rfind(from);
    return at == std::string::npos ? "" : std::string(path).replace(at, from.size(), to);
}

/// The first existing file whose name differs from `path` by one of the swaps.
std::string find_partner(const std::string &path,
                         std::initializer_list<std::pair<const char *, const char *>> swaps) {
    for (const auto &swap : swaps) {
        const std::string name = partner_name(path, swap.first, swap.second);
        if (name.empty()) {
            continue;
        }
        if (exists(name)) {
            return name;
        }
        const std::string stem = name.substr(0, name.rfind('.'));
        for (const char *extension : {".yml", ".yaml", ".xml", ".json"}) {
            if (name.rfind('.') != std::string::npos && exists(stem + extension)) {
                return stem + extension;
            }
        }
    }
    return "";
}

/// The files that a directory stands for: the only one of the conventional sets in it.
std::vector<std::string> files_in(std::string directory) {
    if (directory.back() != '/') {
        directory += '/';
    }
    static const std::vector<std::vector<const char *>> default_names = {
        {"calibration.txt"},
        {"rig.calibration"},
        {"instrument.zoom"},
        {"intrinsics.yml", "extrinsics.yml"},
        {"intrinsics.yaml", "extrinsics.yaml"},
        {"intrinsics.xml", "extrinsics.xml"},
        {"intrinsics.json", "extrinsics.json"},
        {"left.yaml", "right.yaml"},
        {"left.yml", "right.yml"},
        {"camchain.yaml"},
        {"cam0/sensor.yaml", "cam1/sensor.yaml"},
        {"mav0/cam0/sensor.yaml", "mav0/cam1/sensor.yaml"},
        {"left.cameramodel", "right.cameramodel"},
        {"calib.txt"},
        {"calib_cam_to_cam.txt"},
        {"K.txt"},
    };
    std::vector<std::string> found;
    for (const auto &names : default_names) {
        const bool all = std::all_of(names.begin(), names.end(),
                                     [&](const char *name) { return exists(directory + name); });
        if (!all) {
            continue;
        }
        if (!found.empty()) {
            fail(ERROR_ARGUMENT, directory + ": contains more than one calibration (" + found[0] +
                                     " and " + directory + names[0] + "): name the one to use");
        }
        for (const char *name : names) {
            found.push_back(directory + name);
        }
    }
    if (found.empty()) {
        if (exists(directory + "calibration.json")) {
            fail(ERROR_ARGUMENT,
                 directory +
                     ": no pair: calibration.json is of one camera alone, so there is nothing to "
                     "load, convert or export");
        }
        if (access(directory.c_str(), R_OK | X_OK) != 0) {
            fail(ERROR_ARGUMENT, directory + ": " + std::strerror(errno));
        }
        fail(ERROR_ARGUMENT,
             directory +
                 ": no calibration under a known name (calibration.txt, rig.calibration, "
                 "instrument.zoom, "
                 "intrinsics.yml and extrinsics.yml, left.yaml and right.yaml, camchain.yaml, "
                 "left.cameramodel and right.cameramodel, cam0/sensor.yaml and cam1/sensor.yaml, "
                 "calib.txt, calib_cam_to_cam.txt, K.txt): name the file");
    }
    return found;
}

std::vector<std::string> split(const std::string &text, char separator) {
    std::vector<std::string> parts;
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find(separator, begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

std::vector<import_file> read_files(const std::string &path) {
    std::vector<std::string> paths = {path};
    if (input_file_is_directory(path.c_str())) {
        paths = files_in(path);
    } else if (!exists(path) && path.find(',') != std::string::npos) {
        paths = split(path, ',');
    }
    if (paths.size() > 3) {
        fail(ERROR_ARGUMENT, path + ": too many files (a calibration has at most three)");
    }
    std::vector<import_file> files;
    for (const std::string &name : paths) {
        files.push_back(read_file(name));
    }
    return files;
}

import_pair read_own(const import_file &file, const import_options &options) {
    import_pair pair;
    pair.format = "vergence";
    std::string text = file.text;
    calibration_fault fault;
    int code = calibration_parse(text.data(), text.size(), &pair.value, &fault);
    if (code == ERROR_CRC && options.accept_edits) {
        char digits[16];
        std::snprintf(digits, sizeof digits, "%08x\n", fault.crc);
        text.replace(text.size() - 9, 9, digits);
        code = calibration_parse(text.data(), text.size(), &pair.value, &fault);
        pair.assumed.push_back("changes made after the file was written are intended");
    }
    if (code == ERROR_CRC) {
        fail(code, file.path + ": " + calibration_file_explain(code, fault) +
                       "; if it was changed on purpose: vergence info " + file.path +
                       " --accept-edits --convert NEWFILE");
    }
    if (code != ERROR_OK) {
        fail(code, file.path + ": " + calibration_file_explain(code, fault));
    }
    return pair;
}

/// Refuses it: without a pair it has no state.
import_pair read_zoom(const import_file &file) {
    import_pair pair;
    message why;
    pair.format = "vergence";
    const int code =
        calibration_at(file.path.c_str(), file.text.data(), file.text.size(), &pair.value, &why);
    if (code != ERROR_OK) {
        fail(code, why.text);
    }
    return pair;
}

/// Rules for calibrations of every format.
void check_use(const std::string &path, const import_options &options, const import_pair &pair) {
    if (options.rectified && !pair.value.rectified) {
        fail(ERROR_ARGUMENT, path +
                                 ": calibration of raw images, which are not "
                                 "rectified: omit --rectified");
    }
}

/// OpenCV's files may be halves: the other half is next to the one that the user named.
import_pair read_opencv(std::vector<import_file> *files, const import_options &options) {
    try {
        return import_opencv(*files, options);
    } catch (const import_failure &failure) {
        const std::string partner =
            files->size() == 1 ? find_partner(files->front().path, {{"intrinsic", "extrinsic"},
                                                                    {"extrinsic", "intrinsic"},
                                                                    {"INTRINSIC", "EXTRINSIC"},
                                                                    {"EXTRINSIC", "INTRINSIC"}})
                               : "";
        if (failure.code != ERROR_MISSING || partner.empty()) {
            throw;
        }
        files->push_back(read_file(partner));
        return import_opencv(*files, options);
    }
}

/// Formats with one file per camera.
struct camera_format {
    const char *name;          // name with an article
    const char *left, *right;  // words for the sides in names of files
    bool (*matches)(const std::string &text);
    import_pair (*import)(const std::vector<import_file> &files, const import_options &options);
};
const camera_format ros_format = {"a camera_info file", "left", "right", import_ros_matches,
                                  import_ros};
const camera_format mrcal_format = {"a camera of mrcal", "left", "right", import_mrcal_matches,
                                    import_mrcal};
const camera_format euroc_format = {"a camera of EuRoC", "cam0", "cam1", import_euroc_matches,
                                    import_euroc};
const camera_format simrig_format = {"a camera of the simulated rig", "left", "right",
                                     import_simrig_matches, import_simrig};

import_pair read_cameras(const camera_format &format, std::vector<import_file> *files,
                         const import_options &options) {
    if (files->size() == 1) {
        const std::string path = files->front().path;
        const std::string right =
            find_partner(path, {{"left", "right"}, {"LEFT", "RIGHT"}, {format.left, format.right}});
        const std::string left =
            find_partner(path, {{"right", "left"}, {"RIGHT", "LEFT"}, {format.right, format.left}});
        if (right.empty() && left.empty()) {
            fail(ERROR_MISSING, path +
                                    ": is one camera of a pair: name both files, LEFT,RIGHT, or "
                                    "put them side by side as " +
                                    format.left + ".yaml and " + format.right + ".yaml");
        }
        files->insert(right.empty() ? files->begin() : files->end(),
                      read_file(right.empty() ? left : right));
    }
    if (files->size() != 2) {
        fail(ERROR_ARGUMENT,
             files->front().path + ": is " + format.name + ": a pair is two of them, LEFT,RIGHT");
    }
    for (const import_file &file : *files) {
        if (!format.matches(file.text)) {
            fail(ERROR_SYNTAX, file.path + ": is not " + format.name);
        }
    }
    return format.import(*files, options);
}

/// A text format of other programs; the first match wins.
struct text_format {
    bool single;  // one file holds both cameras
    bool (*matches)(const std::string &text);
    import_pair (*read)(std::vector<import_file> *files, const import_options &options);
};

template <const camera_format &format>
import_pair read_format(std::vector<import_file> *files, const import_options &options) {
    return read_cameras(format, files, options);
}

template <import_pair (*import)(const import_file &, const import_options &)>
import_pair read_one(std::vector<import_file> *files, const import_options &options) {
    return import(files->front(), options);
}

const text_format text_formats[] = {
    {true, import_kalibr_matches, read_one<import_kalibr>},
    {false, import_euroc_matches, read_format<euroc_format>},
    {false, import_mrcal_matches, read_format<mrcal_format>},
    {false, import_ros_matches, read_format<ros_format>},
    {true, import_orbslam_matches, read_one<import_orbslam>},
    {false, import_opencv_matches, read_opencv},
    {true, import_depthai_matches, read_one<import_depthai>},
    {true, import_realsense_matches, read_one<import_realsense>},
    {true, import_matrix_matches, read_one<import_matrix>},
    {false, import_simrig_matches, read_format<simrig_format>},
    {true, import_middlebury_matches, read_one<import_middlebury>},
    {true, import_kitti_matches, read_one<import_kitti>},
};

import_pair read_any(std::vector<import_file> *files, const import_options &options) {
    const import_file &first = files->front();
    const std::string magic = CALIBRATION_GRAMMAR_MAGIC;
    const bool single = files->size() == 1;
    if (single && first.text.compare(0, magic.size(), magic) == 0) {
        return read_own(first, options);
    }
    if (single && zoom_calibration_is_text(first.text.data(), first.text.size())) {
        return read_zoom(first);
    }
    if (numpy_array_matches(first.text)) {
        fail(ERROR_SYNTAX, first.path +
                               ": is one array of numpy: save all of the pair in one file, "
                               "numpy.savez(\"pair.npz\", M1=.., D1=.., M2=.., D2=.., "
                               "R=.., T=.., imageSize=(width, height))");
    }
    if (first.text.find('\0') != std::string::npos && !numpy_archive_matches(first.text)) {
        fail(ERROR_SYNTAX, first.path + ": not a calibration (not a text file)");
    }
    for (const text_format &format : text_formats) {
        if ((single || !format.single) && format.matches(first.text)) {
            return format.read(files, options);
        }
    }
    fail(ERROR_SYNTAX,
         first.path +
             ": not a calibration (expected our own text, OpenCV intrinsics/extrinsics, ROS "
             "camera_info, Kalibr, EuRoC, ORB-SLAM, mrcal, Middlebury calib.txt, KITTI, K.txt, "
             "DepthAI, RealSense, numpy's .npz or cameras of the simulated rig)");
}

/// Reads it, and questions a baseline that is probably in another unit. A stated unit settles it if
/// the format prescribes none, or this one. Where the format prescribes another one, the stated
/// unit may be meant for the results: it counts only if it makes the baseline plausible.
import_pair read_lengths(std::vector<import_file> *files, const import_options &options) {
    import_pair pair = read_any(files, options);
    const double stated_mm = import_stated_unit_mm(options);
    message why;
    const int code = length_check_baseline(calibration_baseline_mm(&pair.value),
                                           files->front().path.c_str(), length_unit_option, &why);
    const bool settled =
        stated_mm > 0 && (pair.format_unit_mm == 0 || stated_mm == pair.format_unit_mm);
    if (code == ERROR_OK || settled) {
        return pair;
    }
    if (stated_mm > 0) {
        import_options plain = options;
        plain.unit = "";
        pair = read_any(files, plain);
        if (length_check_baseline(calibration_baseline_mm(&pair.value), files->front().path.c_str(),
                                  length_unit_option, &why) == ERROR_OK) {
            pair.assumed.push_back("lengths are in the unit of the format");
            return pair;
        }
    }
    fail(ERROR_BASELINE, why.text);
}

/// Printable ASCII without the characters that our text rejects.
std::string plain_text(std::string text) {
    for (char &c : text) {
        c = c < ' ' || c > '~' ? '?' : c;
    }
    return text;
}

/// Assumptions go into the note, as whole sentences only.
void write_note(import_pair *pair) {
    std::string note;
    for (const std::string &sentence : pair->assumed) {
        const std::string more = (note.empty() ? "" : "; ") + plain_text(sentence);
        if (note.size() + more.size() < CALIBRATION_NOTE_BYTES) {
            note += more;
        }
    }
    std::snprintf(pair->value.note, sizeof pair->value.note, "%s", note.c_str());
}

/// The id is derived from the contents: the same files are the same calibration wherever they are.
void set_id(const std::vector<import_file> &files, import_pair *pair) {
    uint32_t crc = 0;
    for (const import_file &file : files) {
        crc = crc_update(crc, file.text.data(), file.text.size());
    }
    std::snprintf(pair->value.id, sizeof pair->value.id, "%s-%08x", pair->tag.c_str(), crc);
}

/// Says where the left camera is on the right, which another sign of the translation causes, too.
void question_sides(import_pair *pair) {
    const double *const t_mm = pair->value.translation_right_left_mm;
    const double *const r_rad = pair->value.rotation_right_left_rad;
    const bool alike = std::hypot(r_rad[0], r_rad[1], r_rad[2]) < 1;
    if (alike && t_mm[0] > std::hypot(t_mm[1], t_mm[2])) {
        pair->assumed.push_back(
            "left camera is on the right: if it is not, the translation has the wrong sign");
    }
}

/// Rounds, validates, and detects a pair that is rectified without saying so.
void finish_import(const std::string &path, import_pair *pair) {
    calibration_fault fault{};
    const int code = calibration_file_settle(&pair->value, &fault);
    if (code != ERROR_OK) {
        fail(code, path + ": cannot be used: " + calibration_file_explain(code, fault));
    }
    if (!pair->value.rectified) {
        calibration rectified = pair->value;
        rectified.rectified = true;
        if (calibration_validate(&rectified, nullptr) == ERROR_OK) {
            pair->value.rectified = true;
            pair->assumed.push_back("ideal parallel cameras: images pass through unchanged");
        }
    }
    question_sides(pair);
}

}  // namespace

int calibration_file_settle(calibration *value, calibration_fault *fault) {
    const int rounded = calibration_round(value);
    const int code = calibration_validate(value, fault);  // rounding does not fill `fault`
    INVARIANT(rounded == ERROR_OK || code != ERROR_OK);
    return code;
}

namespace {

/// `read` returns the files.
template <class Read>
int load(const std::string &path, Read read, const import_options &options, calibration *value,
         calibration_file_report *report, std::string *message) {
    try {
        std::vector<import_file> files = read();
        import_pair pair = read_lengths(&files, options);
        if (!pair.tag.empty()) {
            set_id(files, &pair);
            finish_import(path, &pair);
            write_note(&pair);
        }
        check_use(files.front().path, options, pair);
        *value = pair.value;
        if (report != nullptr) {
            report->format = pair.format;
            report->assumed = pair.assumed;
            report->files.clear();
            for (const import_file &file : files) {
                report->files.push_back(file.path);
            }
        }
        return ERROR_OK;
    } catch (const import_failure &failure) {
        *message = failure.message;
        return failure.code;
    } catch (const std::bad_alloc &) {
        throw;
    } catch (const std::exception &error) {
        *message = path + ": cannot read: " + error.what();
        return ERROR_SYNTAX;
    }
}

}  // namespace

int calibration_file_load(const std::string &path, const import_options &options,
                          calibration *value, calibration_file_report *report,
                          std::string *message) {
    return load(
        path, [&path] { return read_files(path); }, options, value, report, message);
}

int calibration_file_convert(const std::vector<import_file> &files, const import_options &options,
                             calibration *value, std::string *message) {
    return load(
        files.front().path, [&files] { return files; }, options, value, nullptr, message);
}

int calibration_file_write(const std::string &path, const calibration &value,
                           std::string *message) {
    char text[CALIBRATION_TEXT_MAX_BYTES];
    const int length = calibration_print(&value, text, sizeof text);
    if (length < 0) {
        *message = path + ": cannot write: " + error_text(length);
        return length;
    }
    if (!whole_file_write(path, std::string(text, static_cast<std::size_t>(length)), message)) {
        return ERROR_BUFFER;
    }
    return ERROR_OK;
}

int calibration_file_loader(const calibration_request *request, calibration *value,
                            char format[CALIBRATION_LOADER_FORMAT_BYTES], message *reason) {
    try {
        import_options options;
        options.width_px = request->image_width_px;
        options.height_px = request->image_height_px;
        options.unit = request->unit != nullptr ? request->unit : "";
        options.rectified = request->rectified;
        options.first_camera = request->first_camera;
        calibration_file_report report;
        std::string text;
        const int code = calibration_file_load(request->path, options, value, &report, &text);
        if (code != ERROR_OK) {
            return message_set(reason, code, "%s", text.c_str());
        }
        std::snprintf(format, CALIBRATION_LOADER_FORMAT_BYTES, "%s", report.format.c_str());
        return ERROR_OK;
    } catch (const std::bad_alloc &) {  // the caller is C: no exception may reach it
        return message_set(reason, ERROR_MEMORY, "%s: out of memory", request->path);
    }
}
