// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_request.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <fstream>

#include "core/error.h"
#include "daemon/base/workers.h"
#include "daemon/cli/options.h"
#include "daemon/files/input_file.h"
#include "stereo/geometry/calibration.h"
#include "tools/host/calibrate/board_pdf.hpp"
#include "tools/host/calibrate/calibrate_inputs.hpp"
#include "tools/host/calibrate/option_rows.hpp"

namespace {

const int operands_max = 4096;

struct request {
    calibrate_board_request board;
    const char *out, *corner_cache, *id, *date, *note;
    const char *touch_up, *verify;
    double length, from[4], to[4], infinity[4];
    int threads, model;
    bool single, paper;
    calibrate_output output;
};

const command_argument known_options[] = {
    text_option(
        "board", offsetof(request, board.corners), "COLUMNSxROWS",
        "Inner corners of the board: one less than squares, along a row and from row to row, 2 to "
        "255 each. This also applies to coded boards (a CharucoBoard of 10x7 squares is 9x6). "
        "Boards of circles or dots are not read. Required, except with --length or --infinity."),
    number_option(
        "square", COMMAND_NUMBER, offsetof(request, board.square), "MM",
        "Side of one square in mm, measured on the print over as many squares as possible: all "
        "reconstructed lengths depend on it. Required "
        "with --board.",
        calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    text_option(
        "charuco", offsetof(request, board.dictionary), "DICT",
        "The white squares carry markers of this dictionary, as in 5x5_50 or DICT_5X5_50. Such a "
        "board may be partly hidden and has a unique orientation."),
    number_option("marker", COMMAND_NUMBER, offsetof(request, board.marker), "MM",
                  "With --charuco: side of a marker in mm, including its black border.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    choice_option("unit", offsetof(request, board.unit), "UNIT",
                  "Unit of --square and --marker; results are in mm. Default: mm, but boards below "
                  "20 mm across "
                  "are then rejected.",
                  calibrate_board_units),
    choice_option(
        "model", offsetof(request, model), "MODEL",
        "Distortion of the lenses: auto (the simplest that predicts board positions that were "
        "held out), none, the coefficients to estimate, as OpenCV calls them (the others are 0), "
        "or, "
        "for wide lenses, rational or equidistant (OpenCV's fisheye). "
        "More than the views determine makes the image's corners worse. Default: auto.",
        "auto none k1 k1-k2 k1-k2-p1-p2 k1-k2-p1-p2-k3 rational equidistant"),
    text_option(
        "out", offsetof(request, out), "DIR",
        "Directory for the results; created when missing. Files of an earlier run in it are "
        "replaced. Default: calibration."),
    text_option("corners", offsetof(request, corner_cache), "FILE",
                "Known corners, in mrcal's and mrgingham's format (vnlog); pictures that it does "
                "not name are searched. Every run writes such a file, corners.vnl."),
    text_option("touch-up", offsetof(request, touch_up), "FILE.zoom",
                "Correct a calibration of all zooms for the state of the pairs, by the board's "
                "size: prints how well it holds, and writes rig.calibration for the last pair, "
                "valid until pan or lenses move."),
    text_option(
        "verify", offsetof(request, verify), "FILE.zoom",
        "Compare a calibration of all zooms with the board, at the states of the pairs: "
        "squares in mm and rows in pixels, against what it predicts, with the cameras where "
        "the motors read and refined as every pair is. Writes nothing; exit code 5: not as "
        "predicted."),
    number_option("length", COMMAND_NUMBER, offsetof(request, length), "MM",
                  "For --touch-up and --verify of one pair, SESSION:N, in place of a board: the "
                  "distance between two marks anywhere in the scene.",
                  1, 1e6, 0, 0, "mm"),
    mark_from_option(offsetof(request, from)),
    mark_to_option(offsetof(request, to)),
    number_option("infinity", COMMAND_NUMBER, offsetof(request, infinity), "X,Y,X,Y",
                  "For --touch-up of one pair: a thing so far away that its distance does not "
                  "matter, such as a star or a mast on the horizon, in both pictures. Alone, or "
                  "beside a board or a length.",
                  0, 32768, 4, ','),
    flag_option("single", offsetof(request, single),
                "Only one camera: calibrate its lens. rig.calibration is not written."),
    flag_option("paper", offsetof(request, paper),
                "A recording with several zooms: for comparison, calibrate each zoom alone and "
                "draw straight lines through the results."),
    text_option(
        "id", offsetof(request, id), "NAME",
        "Name of the calibration: letters, digits, dot, dash and underline. Default: one made from "
        "the corners."),
    text_option(
        "date", offsetof(request, date), "YYYY-MM-DD",
        "Date that the calibration states. Default: none, so that the same pictures give the same "
        "bytes."),
    text_option("note", offsetof(request, note), "TEXT",
                "A remark stored in the calibration, in printable ASCII."),
    number_option("threads", COMMAND_INTEGER, offsetof(request, threads), "N",
                  "Number of threads; the result does not depend on it. Default: all processors.",
                  1, WORKERS_MAX_THREADS),
    flag_option("json", offsetof(request, output.json),
                "Print calibration.json on standard output instead of the summary."),
    flag_option("quiet", offsetof(request, output.quiet), "Print no summary, notes or progress."),
};

const option_page request_page = {
    "vergence calibrate",
    "IMAGES...",
    "calibrate a stereo pair from pictures of a board",
    "Takes pictures of one board that both cameras saw at the same moments, in about fifteen "
    "positions: near and far, in the middle and in the corners of the image, tilted by 30 degrees "
    "in different directions. Finds the corners, the lenses, the poses of the cameras, and errors: "
    "pictures without a usable board, boards that moved between left and right, single bad "
    "corners. Each is named with the reason and left out.\n"
    "IMAGES are pictures, folders, recorded sessions (directories that \"capture\" or \"record\" "
    "of "
    "vergenced made; all their pairs are used, or pair N of SESSION:N), quoted patterns or lists, "
    "in any mixture. The side "
    "comes from "
    "the names (left and right, or L and R, in the file's or the folder's name), pairs from what "
    "else the names contain (left07.png and right07.png). If names state no side, name two folders "
    "or "
    "two quoted patterns, the left camera's first. A list is a text with one or two names per line "
    "(left, then right), or an image list of OpenCV in XML or YAML. A picture without a partner "
    "is used for its own camera.\n"
    "Pictures may be 8 or 16 bit, grey or colour, and are rotated according to their orientation "
    "tag. "
    "All pictures of one camera must have the same size and orientation. A plain board must be "
    "entirely visible; of a coded one (--charuco) any part will do.\n"
    "For motorized zooms, \"vergence calibrate capture\" guides through the pictures at all zooms; "
    "see its --help.\n"
    "Sessions whose zooms move through four positions or more, as \"vergence calibrate capture\" "
    "takes them, are calibrated as one rig: DIR then gets instrument.zoom instead of "
    "rig.calibration, from which follows the calibration at any zoom, focus and pan in between.\n"
    "The last line says whether the calibration is good, and if not, why. Results in DIR: "
    "rig.calibration (for \"vergence reconstruct --calibration\"), calibration.html (residuals, "
    "coverage, error bars: open it in a browser), calibration.json (all figures), corners.vnl "
    "(the corners, in mrcal's format). They appear together when all is written; until then, and "
    "after "
    "any failure, DIR contains nothing of this run.\n"
    "Exit codes: 0 good; 5 written, but not good: the files say so (\"NOT GOOD\" in "
    "rig.calibration's note, which \"vergence reconstruct\" repeats); 3 nothing could be "
    "calibrated from these pictures; 1, 2 and 130 see \"vergence --help\".",
    "vergence calibrate pictures/ --board 9x6 --square 30\n"
    "vergence calibrate files/board-* --board 9x6 --square 30\n"
    "vergence calibrate 'left*.jpg' 'right*.jpg' --board 9x6 --square 30 --out rig\n"
    "vergence calibrate cam_a/ cam_b/ --board 9x6 --square 30\n"
    "vergence calibrate stereo_calib.xml --board 9x6 --square 30 --json\n"
    "vergence calibrate left/ right/ --board 13x9 --square 20 --charuco 5x5_100 --marker 15\n"
    "vergence calibrate pictures/ --board 9x6 --square 30 --model k1-k2\n"
    "vergence calibrate 'left*.jpg' --single --board 9x6 --square 30\n"
    "vergence calibrate files/look:2 --touch-up instrument.zoom --board 10x7 --square 24 "
    "--charuco 4x4_50 --marker 17 --corners files/look/corners.vnl",
    known_options,
    sizeof known_options / sizeof known_options[0],
    1,
    operands_max,
};

/// Whether the calendar has this day, in the form that our own text requires.
bool is_day(const char *date) {
    calibration probe{};
    std::snprintf(probe.id, sizeof probe.id, "probe");
    const int length = std::snprintf(probe.date, sizeof probe.date, "%s", date);
    return length < static_cast<int>(sizeof probe.date) &&
           calibration_validate(&probe, nullptr) != ERROR_SYNTAX;  // it looks at the texts first
}

bool is_of_id(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
}

bool is_printable(char c) {
    return c >= ' ' && c <= '~';
}

bool holds_only(const std::string &text, size_t max, bool (*good)(char)) {
    return text.size() <= max && std::all_of(text.begin(), text.end(), good);
}

bool is_given(const double place[4]) {
    return place[0] >= 0;
}

std::string check_marks(const request &asked) {
    const bool has_length = asked.length > 0;
    if (asked.touch_up != nullptr && asked.verify != nullptr) {
        return "--touch-up and --verify cannot be combined";
    }
    if (has_length != is_given(asked.from) || has_length != is_given(asked.to)) {
        return "--length MM requires --from and --to, and they require it";
    }
    if (has_length && asked.touch_up == nullptr && asked.verify == nullptr) {
        return "--length requires --touch-up or --verify";
    }
    if (is_given(asked.infinity) && asked.touch_up == nullptr) {
        return "--infinity requires --touch-up";
    }
    return has_length && asked.board.corners != nullptr ? "--length and --board cannot be combined"
                                                        : "";
}

touch_up_marks marks_of(const request &asked) {
    touch_up_marks marks;
    marks.length_mm = asked.length;
    marks.far = is_given(asked.infinity);
    std::copy(asked.from, asked.from + 4, marks.mark[0].begin());
    std::copy(asked.to, asked.to + 4, marks.mark[1].begin());
    std::copy(asked.infinity, asked.infinity + 4, marks.infinity.begin());
    return marks;
}

/// Errors that the option table cannot check; "" when all is well.
std::string check_texts(const request &asked) {
    if (asked.id != nullptr && !holds_only(asked.id, 47, is_of_id)) {
        return "--id must be up to 47 letters, digits, dots, dashes and underlines";
    }
    if (asked.date != nullptr && !is_day(asked.date)) {
        return std::string("--date \"") + asked.date + "\": not a date (expected YYYY-MM-DD)";
    }
    if (asked.note != nullptr && !holds_only(asked.note, 200, is_printable)) {
        return "--note must be up to 200 printable ASCII characters";
    }
    return check_marks(asked);
}

bool read_cache(const char *path, const calib::board &board, std::vector<calib::cached_view> *views,
                std::string *error) {
    message last_error{};
    FILE *stream = input_file_open(path, &last_error);
    if (stream == nullptr) {
        *error = last_error.text;
        return false;
    }
    std::fclose(stream);
    std::ifstream in(path);
    if (!calib::corner_cache_read(in, board, views, error)) {
        *error = std::string(path) + ": " + *error;
        return false;
    }
    return true;
}

std::string text_or(const char *text, const char *otherwise) {
    return text != nullptr ? text : otherwise;
}

/// Checks the options; the board and the marks go into the job. "" when all is well.
std::string check_job(const request &asked, calibrate_job *job) {
    const std::string error = check_texts(asked);
    job->marks = marks_of(asked);
    const bool needs_board = !job->marks.any() || asked.board.corners != nullptr;
    return error.empty() && needs_board ? calibrate_board_make(asked.board, &job->board) : error;
}

bool read_inputs(const request &asked, const std::vector<std::string> &paths, calibrate_job *job,
                 std::string *error) {
    calibrate_names names;
    const bool frames_may_miss = asked.corner_cache != nullptr || job->board.columns == 0;
    return calibrate_names_expand(paths, frames_may_miss, &names, error) &&
           calibrate_names_pair(names, asked.single, &job->inputs, error) &&
           (asked.corner_cache == nullptr ||
            read_cache(asked.corner_cache, job->board, &job->cache, error));
}

/// The rest of the job, which needs no check.
void fill_job(const request &asked, calibrate_job *job) {
    if (asked.model > 0) {  // words after "auto" are in the order of the kinds
        job->distortion = static_cast<calib::lens_model::kind>(asked.model - 1);
    }
    job->single = asked.single;
    job->paper = asked.paper;
    job->threads = asked.threads;
    job->out_path = text_or(asked.out, "");
    job->id = text_or(asked.id, "");
    job->date = text_or(asked.date, "");
    job->note = text_or(asked.note, "");
    job->verify = asked.verify != nullptr;
    job->zoom = text_or(job->verify ? asked.verify : asked.touch_up, "");
}

/// Everything but the words themselves.
int complete(const request &asked, const std::vector<std::string> &paths, calibrate_job *job,
             std::string *message) {
    *message = check_job(asked, job);
    if (!message->empty()) {
        return CLIENT_USAGE;
    }
    if (!read_inputs(asked, paths, job, message)) {
        return CLIENT_BAD_INPUT;
    }
    if (job->marks.any() && job->inputs.shots.size() != 1) {
        *message = "marks belong to one pair: name it as SESSION:N";
        return CLIENT_USAGE;
    }
    fill_job(asked, job);
    return CLIENT_OK;
}

request no_request() {
    request asked{};
    asked.from[0] = asked.to[0] = asked.infinity[0] = -1;  // not given
    return asked;
}

}  // namespace

int calibrate_request_parse(int argc, char **argv, calibrate_job *job, calibrate_output *output,
                            std::string *message) {
    request asked = no_request();
    std::vector<const char *> operands(operands_max);
    int count = 0;
    const int parsed = options_parse(&request_page, argc, argv, &asked, operands.data(), &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    *output = asked.output;
    asked.out = asked.out != nullptr ? asked.out : "calibration";
    const int code = complete(asked, {operands.begin(), operands.begin() + count}, job, message);
    return code == CLIENT_OK ? OPTIONS_CONTINUE : code;
}

int calibrate_request_read(int argc, char **argv, calibrate_job *job, std::string *message) {
    request asked = no_request();
    std::vector<const char *> operands(operands_max);
    int count = 0;
    struct message line {};
    if (options_read(&request_page, argc, argv, &asked, operands.data(), &count, &line) !=
        ERROR_OK) {
        *message = line.text;
        return CLIENT_USAGE;
    }
    return complete(asked, {operands.begin(), operands.begin() + count}, job, message);
}
