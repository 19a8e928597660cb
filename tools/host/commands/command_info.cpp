// SPDX-License-Identifier: Apache-2.0
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <sstream>

#include "console/pair/calibration_at.h"
#include "core/error.h"
#include "core/invariant.h"
#include "daemon/cli/options.h"
#include "daemon/files/input_file.h"
#include "daemon/session/session_pairs.h"
#include "stereo/geometry/calibration_grammar.h"
#include "stereo/zoom/zoom_grammar.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/convert/export.hpp"
#include "tools/host/convert/export_zoom.hpp"
#include "tools/host/info/info.hpp"
#include "tools/host/info/info_zoom.hpp"

namespace {

using json = nlohmann::ordered_json;

struct request {
    bool json = false, grammar = false, zoom_grammar = false, accept_edits = false,
         rectified = false;
    const char *convert = nullptr, *out = nullptr, *at = nullptr;
    double depth[2] = {-1, -1}, distance[4] = {-1, -1, -1, -1}, plane[4] = {-1, -1, -1, -1};
    int size_px[2] = {0, 0};
    int unit = -1, first_camera = -1, export_format = -1;
};

/// Files of one state, then tables of all zooms.
const char *const all_export_formats = "opencv ros kalibr mrcal gyroflow opentrackio";
const int state_formats = 4;

/// As `vergence calibrate` names a calibration of all zooms.
const char *const zoom_file_name = "instrument.zoom";
const char *const result_name = "result.json";

const command_argument options[] = {
    flag_option("json", offsetof(request, json),
                "Print one JSON document: a list with an object for each file."),
    text_option("convert", offsetof(request, convert), "NEW",
                "Write the calibration as our own text to the file NEW."),
    choice_option(
        "export", offsetof(request, export_format), "FORMAT",
        "Write the calibration as the files of another program into the directory of --out: "
        "intrinsics.yml and extrinsics.yml; left.yaml and right.yaml; camchain.yaml; "
        "left.cameramodel "
        "and right.cameramodel. From a calibration of all zooms without --at: lens tables, "
        "left.json "
        "and right.json.",
        all_export_formats),
    text_option("out", offsetof(request, out), "DIR", "Where --export writes."),
    text_option(
        "at", offsetof(request, at), "STATE|X,Y",
        "Of a calibration of all zooms: at these axes, zoom=421,focus=540,pan=3.97,"
        "right_pan=-3.97 (counts and degrees; distance=MM focuses and turns both), or at "
        "those of a recorded pair, SESSION or SESSION:NUMBER. Of a result: column and row of its "
        "maps, as the report shows them; prints where that point is in both images, as "
        "--from and --to of \"vergence calibrate\" take it."),
    number_option("depth", COMMAND_NUMBER, offsetof(request, depth), "X,Y",
                  "Of a result: the depth at a pixel of its maps and its standard deviation, with "
                  "the part of it that is common to all points, as the calibration's errors are.",
                  0, 32768, 2, ','),
    number_option("distance", COMMAND_NUMBER, offsetof(request, distance), "X,Y,X,Y",
                  "The same of the distance between the points at two pixels.", 0, 32768, 4, ','),
    number_option("plane", COMMAND_NUMBER, offsetof(request, plane), "X,Y,W,H",
                  "The same of the plane through the points in a window of the maps: its distance "
                  "from the left camera, its tilt, and how flat it is.",
                  0, 32768, 4, ','),
    number_option("size", COMMAND_INTEGER, offsetof(request, size_px), "WIDTHxHEIGHT",
                  "Size of the raw images in pixels, for calibrations that do not state it "
                  "(OpenCV's, some of KITTI's, K.txt) or state several (RealSense's).",
                  1, 32768, 2, 'x'),
    choice_option("unit", offsetof(request, unit), "UNIT",
                  "Unit of length of a calibration of another program. Default: what its format "
                  "prescribes, mm where it prescribes none (OpenCV's). Without it a baseline below "
                  "5 mm or above 10 m is rejected, as the unit is probably another one.",
                  "mm cm m"),
    flag_option("rectified", offsetof(request, rectified),
                "The images are already rectified: use the rectified cameras (P1 and P2, P_rect) "
                "of the file "
                "instead of the raw ones."),
    number_option("first-camera", COMMAND_INTEGER, offsetof(request, first_camera), "N",
                  "KITTI: number of the left camera, 0 for the grey pair, 2 for the colour one "
                  "(default where "
                  "the file has it).",
                  0, 8),
    flag_option("accept-edits", offsetof(request, accept_edits),
                "Accept a calibration of our own text whose checksum does not match because it was "
                "edited on "
                "purpose; with --convert the new file gets the right checksum."),
    flag_option("grammar", offsetof(request, grammar),
                "Print the table of fields of our calibration text and exit."),
    flag_option("zoom-grammar", offsetof(request, zoom_grammar),
                "The same for a calibration of all zooms."),
};

const int files_max = 256;

const option_page page_of_command = {
    "vergence info",
    "FILE...",
    "explain a calibration, a result or a session",
    "Explains each FILE: calibrations (our own text, OpenCV intrinsics and extrinsics, also as "
    "arrays that numpy.savez wrote, ROS camera_info pairs, Kalibr's camchain.yaml, EuRoC's "
    "sensor.yaml pairs, ORB-SLAM's settings of a stereo camera, mrcal's .cameramodel "
    "pairs, Middlebury calib.txt, KITTI, K.txt, DepthAI's EEPROM as JSON, the table of a RealSense "
    "as JSON or as rs-enumerate-devices -c prints it, true cameras of the simulated rig) with the "
    "figures that follow from them, and results "
    "(result.json, a result directory, PFM, PNG, PGM, PLY, PCD, GLB) with sizes, counts and "
    "extents; and recorded sessions, with how each pair was taken: axes, exposure, brightness, "
    "and whether the session's calibration matches.\n"
    "A calibration of several files is named by one of them, by all of them, by its directory, or "
    "as "
    "a list FILE,FILE.",
    "vergence info rig.txt\n"
    "vergence info intrinsics.yml --size 640x480 --convert rig.txt\n"
    "vergence info rig.txt --export ros --out camera_info/\n"
    "vergence info instrument.zoom --at zoom=421,distance=1800 --convert rig.txt\n"
    "vergence info results --at 120,80\n"
    "vergence info results --depth 120,80 --distance 120,80,150,80\n"
    "vergence info results --plane 10,10,60,100\n"
    "vergence info instrument.zoom --export gyroflow --out lenses/\n"
    "vergence info results/ --json\n"
    "vergence info files/scene",
    options,
    sizeof options / sizeof options[0],
    0,
    files_max};

bool exists(const std::string &path) {
    struct stat status;
    return stat(path.c_str(), &status) == 0;
}

using reader = bool (*)(const std::string &, info_page *, std::string *);

bool refuse_compact(const std::string &path, info_page *, std::string *message) {
    *message = path + ": a compact surface (\"vergence reconstruct " + path +
               " --out DIR\" makes the result that is explained here)";
    return false;
}

/// The reader for a result file, by its first bytes; null: it must be a calibration.
reader reader_for(const std::string &path) {
    static const struct {
        const char *magic;
        reader read;
    } kinds[] = {{"ply\n", info_ply},
                 {"ply\r", info_ply},
                 {"glTF", info_glb},
                 {"# .PCD", info_pcd},
                 {"VERSION ", info_pcd},
                 {"Pf\n", info_map},
                 {"PF\n", info_map},
                 {"\x89PNG", info_image},
                 {"P5", info_image},
                 {"P6", info_image},
                 {"P2\n", info_image},
                 {"P3\n", info_image},
                 {"vergence compact surface ", refuse_compact}};
    const std::string head = info_head(path);
    for (const auto &kind : kinds) {
        if (head.compare(0, std::strlen(kind.magic), kind.magic) == 0) {
            return kind.read;
        }
    }
    // OpenCV also writes calibrations as JSON, but with a marker at the beginning.
    if (head.compare(0, 1, "{") == 0 &&
        head.find("\"program\": \"vergence\"") != std::string::npos) {
        return info_result;
    }
    return nullptr;
}

/// The reader for an operand, which may be a directory.
reader reader_of(const std::string &path) {
    if (session_pairs_here(path.c_str())) {
        return info_session;
    }
    return input_file_is_directory(path.c_str()) ? nullptr : reader_for(path);
}

/// The matching word of a list of words separated by blanks.
std::string choice_text(const char *choices, int number) {
    std::istringstream words(choices);
    std::string word;
    for (int i = 0; i <= number; i++) {
        words >> word;
    }
    return word;
}

/// Reports the files of an export, and what their format cannot hold.
void add_exported(const std::vector<std::string> &paths, const std::string &loss, info_page *page) {
    std::string text;
    for (const std::string &written : paths) {
        text += (text.empty() ? "" : ", ") + written;
    }
    page->add("exported", "exported", text, paths);
    if (!loss.empty()) {
        page->add("loss", "loss", loss, loss);
    }
}

/// The requests of --convert and --export.
bool write_calibration(const std::string &path, const calibration &value, const request &asked,
                       info_page *page, std::string *message) {
    if (asked.convert != nullptr) {
        if (calibration_file_write(asked.convert, value, message) != ERROR_OK) {
            return false;
        }
        page->add("written", "written", asked.convert, asked.convert);
    }
    if (asked.out != nullptr) {
        std::vector<std::string> paths;
        std::string loss;
        const std::string format = choice_text(all_export_formats, asked.export_format);
        if (asked.export_format >= state_formats) {
            *message = path + ": " + format +
                       " is a table over zooms: it needs a calibration of all zooms, without --at";
            return false;
        }
        if (export_write(value, format, asked.out, &paths, &loss, message) != ERROR_OK) {
            *message = path + ": cannot export: " + *message;
            return false;
        }
        add_exported(paths, loss, page);
    }
    return true;
}

/// A calibration of all zooms as a whole: its page, and its lens tables.
bool write_zoom(const std::string &path, const zoom_calibration &value, const request &asked,
                info_page *page, std::string *message) {
    *page = info_zoom(path, value);
    if (asked.convert != nullptr || (asked.out != nullptr && asked.export_format < state_formats)) {
        *message = path + ": is a calibration of all zooms: name a state with --at";
        return false;
    }
    if (asked.out == nullptr) {
        return true;
    }
    std::vector<std::string> paths;
    std::string loss;
    const std::string format = choice_text(all_export_formats, asked.export_format);
    if (export_write_files(export_zoom(value, format), asked.out, &paths, &loss, message) !=
        ERROR_OK) {
        *message = path + ": cannot export: " + *message;
        return false;
    }
    add_exported(paths, loss, page);
    return true;
}

bool read_zoom(const std::string &path, const zoom_calibration &value, const request &asked,
               info_page *page, std::string *message) {
    if (asked.at == nullptr) {
        return write_zoom(path, value, asked, page, message);
    }
    zoom_state state;
    calibration at;
    struct message why {};
    if (!info_zoom_state(asked.at, value, &state, message)) {
        return false;
    }
    if (calibration_at_state(&value, &state, "", &at, &why) != ERROR_OK) {
        *message = path + ": " + why.text;
        return false;
    }
    calibration_fault fault{};
    const int code = calibration_file_settle(&at, &fault);
    INVARIANT(code == ERROR_OK);  // it was validated
    *page = info_calibration(path, at, {"vergence", {path}, {}});
    return write_calibration(path, at, asked, page, message);
}

import_options import_options_of(const request &asked) {
    static const char *const units[] = {"mm", "cm", "m"};
    import_options import;
    import.width_px = asked.size_px[0];
    import.height_px = asked.size_px[1];
    import.unit = asked.unit >= 0 ? units[asked.unit] : "";
    import.rectified = asked.rectified;
    import.first_camera = asked.first_camera;
    import.accept_edits = asked.accept_edits;
    return import;
}

info_places places_of(const request &asked) {
    return {asked.depth[0] >= 0 ? asked.depth : nullptr,
            asked.distance[0] >= 0 ? asked.distance : nullptr,
            asked.plane[0] >= 0 ? asked.plane : nullptr};
}

bool has_places(const request &asked) {
    return asked.depth[0] >= 0 || asked.distance[0] >= 0 || asked.plane[0] >= 0;
}

bool read_calibration(const std::string &path, const request &asked, info_page *page,
                      std::string *message) {
    message->clear();
    const bool in_folder =
        input_file_is_directory(path.c_str()) && exists(path + "/" + zoom_file_name);
    const std::string file = in_folder ? path + "/" + zoom_file_name : path;
    const std::unique_ptr<zoom_calibration> zoom =
        input_file_is_directory(file.c_str()) ? nullptr : info_zoom_read(file, message);
    if (zoom != nullptr) {
        return read_zoom(file, *zoom, asked, page, message);
    }
    if (!message->empty()) {
        return false;
    }
    if (asked.at != nullptr) {
        *message = path + (exists(path) ? ": --at requires a calibration of all zooms, or a result"
                                        : ": No such file or directory");
        return false;
    }
    calibration value;
    calibration_file_report report;
    if (calibration_file_load(path, import_options_of(asked), &value, &report, message) !=
        ERROR_OK) {
        return false;
    }
    *page = info_calibration(path, value, report);
    return write_calibration(path, value, asked, page, message);
}

bool read_lengths(const std::string &path, reader read, const request &asked, info_page *page,
                  std::string *message) {
    if (read == refuse_compact) {
        return read(path, page, message);
    }
    if (read != info_result || asked.at != nullptr || asked.convert != nullptr) {
        *message = path + (access(path.c_str(), F_OK) != 0
                               ? std::string(": ") + std::strerror(errno)
                               : ": --depth, --distance and --plane need the directory of a result "
                                 "with result.json and points.pcd, and no --at");
        return false;
    }
    page->path = path;
    try {
        return read(path, page, message) && info_lengths(path, places_of(asked), page, message);
    } catch (const json::exception &) {
        *message = path + ": damaged";
        return false;
    }
}

bool read_page(const std::string &path, const request &asked, info_page *page,
               std::string *message) {
    const reader read = reader_of(path);
    if (has_places(asked)) {
        return read_lengths(path, read, asked, page, message);
    }
    if (read == nullptr) {
        return read_calibration(path, asked, page, message);
    }
    if (asked.convert != nullptr || asked.out != nullptr) {
        *message = path + ": not a calibration: there is nothing to convert";
        return false;
    }
    double at_px[2];
    if (asked.at != nullptr && (read != info_result || !info_is_point(asked.at, at_px))) {
        *message =
            path + (read == info_result ? ": --at of a result takes X,Y, a pixel of its maps"
                                        : ": --at needs a result or a calibration of all zooms");
        return false;
    }
    page->path = path;
    try {
        return read(path, page, message) &&
               (asked.at == nullptr || info_point(path, at_px, page, message));
    } catch (const json::exception &) {
        *message = path + ": damaged";
        return false;
    }
}

void print_text(const info_page &page) {
    size_t width = 0;
    for (const info_row &row : page.rows) {
        width = std::max(width, row.label.size());
    }
    std::cout << page.path << ": " << page.kind << "\n";
    for (const info_row &row : page.rows) {
        if (!row.label.empty() || !row.text.empty()) {
            std::cout << "  " << row.label << std::string(width - row.label.size() + 2, ' ')
                      << row.text << "\n";
        }
    }
}

json to_json(const info_page &page) {
    json object = {{"path", page.path}, {"kind", page.kind}};
    for (const info_row &row : page.rows) {
        if (!row.key.empty()) {
            object[row.key] = row.value;
        }
    }
    return object;
}

/// The fields of a text of calibration as the Markdown table of calibration.md.
int print_grammar(const keyed_table &table) {
    std::cout << "| field | values | decimals | range | unit | meaning |\n"
              << "|---|---|---|---|---|---|\n";
    for (int i = 0; i < table.count; i++) {
        const keyed_field &field = table.fields[i];
        const bool series = &table == &zoom_grammar && field.kind == ZOOM_FIELD_FUNCTION;
        std::cout << "| `" << field.name << "` | "
                  << (series ? "1 to " + std::to_string(ZOOM_TERMS_MAX + 1)
                             : std::to_string(field.count))
                  << " | ";
        if (field.min != field.max) {
            std::cout << field.decimals << " | " << field.min << ".." << field.max;
        } else {
            std::cout << " | ";
        }
        std::cout << " | " << field.unit << " | " << field.meaning << " |\n";
    }
    std::cout.flush();
    return CLIENT_OK;
}

int refuse(const std::string &mistake) {
    std::fprintf(stderr, "vergence info: %s; see \"vergence info --help\"\n", mistake.c_str());
    return CLIENT_USAGE;
}

int explain_all(const std::vector<std::string> &paths, const request &asked) {
    int result = CLIENT_OK;
    json list = json::array();
    bool first = true;
    for (const std::string &path : paths) {
        info_page page;
        std::string message;
        if (!read_page(path, asked, &page, &message)) {
            std::fprintf(stderr, "vergence info: %s\n", message.c_str());
            result = CLIENT_BAD_INPUT;
            continue;
        }
        if (!page.mismatch.empty()) {
            std::fprintf(stderr, "vergence info: %s: %s\n", path.c_str(), page.mismatch.c_str());
            result = CLIENT_BAD_INPUT;
        }
        if (asked.json) {
            list.push_back(to_json(page));
            continue;
        }
        std::cout << (first ? "" : "\n");
        print_text(page);
        first = false;
    }
    if (asked.json) {
        // Names of files and cameras need not be UTF-8.
        std::cout << list.dump(2, ' ', false, json::error_handler_t::replace) << "\n";
    }
    std::cout.flush();
    return result;
}

/// The files of an operand: with places, of a result's folder only result.json.
std::vector<std::string> expand(const std::string &name, const request &asked) {
    const std::string result = name + "/" + result_name;
    const bool one = (asked.at != nullptr || has_places(asked)) && exists(result);
    return one ? std::vector<std::string>{result} : info_expand(name);
}

}  // namespace

int command_info(int argc, char **argv) {
    request asked;
    std::vector<const char *> operands(files_max);
    int count = 0;
    const int code = options_parse(&page_of_command, argc, argv, &asked, operands.data(), &count);
    if (code != OPTIONS_CONTINUE) {
        return code;
    }
    if (asked.grammar) {
        return print_grammar(calibration_grammar);
    }
    if (asked.zoom_grammar) {
        return print_grammar(zoom_grammar);
    }
    if (count == 0) {
        return refuse("name a calibration, a result file, a result directory or a session");
    }
    std::vector<std::string> names(operands.begin(), operands.begin() + count);
    info_join_pairs(import_options_of(asked), &names);
    if (asked.convert != nullptr && names.size() != 1) {
        return refuse("--convert requires exactly one calibration");
    }
    if ((asked.export_format >= 0) != (asked.out != nullptr)) {
        return refuse("--export requires --out DIR, and --out requires --export FORMAT");
    }
    if (asked.out != nullptr && (names.size() != 1 || *asked.out == '\0')) {
        return refuse("--export requires exactly one calibration and a directory");
    }
    std::vector<std::string> paths;
    for (const std::string &name : names) {
        const std::vector<std::string> more = expand(name, asked);
        paths.insert(paths.end(), more.begin(), more.end());
    }
    return explain_all(paths, asked);
}
