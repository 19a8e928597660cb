// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/base/workers.h"
#include "daemon/cli/options.h"
#include "daemon/session/session_notes.h"
#include "daemon/surface/reconstruct_request.h"
#include "tools/host/calibrate/board_pdf.hpp"
#include "tools/host/calibrate/calibrate_touch_up.hpp"
#include "tools/host/commands/commands.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

/// Options of `reconstruct` that a session of `measure` decides, or that are for pictures.
const char *const decided[] = {"pair",      "with-pair", "all",      "disparity",
                               "rectified", "focal",     "baseline", "unit",
                               "bayer",     "bits",      "raw",      "first-camera"};

struct request {
    reconstruct_request surface;  // the first: offsets of its options are into this
    calibrate_board_request board;
    double length, from[4], to[4];
};

/// A thing of known size in the pictures: options as of "vergence calibrate --touch-up".
const command_argument own_options[] = {
    text_option("board", offsetof(request, board.corners), "COLUMNSxROWS",
                "Both cameras of the measured pair see a calibration board with so many inner "
                "corners: its size corrects the cameras, too, which makes the error that all "
                "depths share smaller."),
    number_option("square", COMMAND_NUMBER, offsetof(request, board.square), "MM",
                  "Side of one square of the board, measured on the print.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    text_option("charuco", offsetof(request, board.dictionary), "DICT",
                "The white squares carry markers of this dictionary, as in 5x5_50."),
    number_option("marker", COMMAND_NUMBER, offsetof(request, board.marker), "MM",
                  "With --charuco: side of a marker, including its black border.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    number_option("length", COMMAND_NUMBER, offsetof(request, length), "MM",
                  "In place of a board: the distance between two marks anywhere in the scene, "
                  "which --from and --to name.",
                  1, 1e6, 0, 0, "mm"),
    mark_from_option(offsetof(request, from)),
    mark_to_option(offsetof(request, to)),
};

/// Help of options that "vergence reconstruct" requires, and "vergence measure" does not.
const char out_help[] =
    "Directory for the results; created if missing. Results of an earlier run in it, which its "
    "hidden list .vergence-files names, are replaced; a file of another origin with a result's "
    "name is refused. Default: SESSION-surface.";
const char calibration_help[] =
    "Another calibration of all zooms or of the pair. Default: the one in the session.";

std::vector<command_argument> options_of() {
    std::vector<command_argument> options(std::begin(own_options), std::end(own_options));
    for (std::size_t i = 0; i < reconstruct_argument_count; i++) {
        const char *name = reconstruct_arguments[i].name;
        if (std::none_of(std::begin(decided), std::end(decided),
                         [&](const char *one) { return std::strcmp(one, name) == 0; })) {
            options.push_back(reconstruct_arguments[i]);
            if (std::strcmp(name, "out") == 0) {
                options.back().help = out_help;
            } else if (std::strcmp(name, "calibration") == 0) {
                options.back().help = calibration_help;
            }
        }
    }
    return options;
}

const char description[] =
    "Makes the surface of a measurement that \"measure\" took at an instrument (\"vergence "
    "--connect ADDRESS measure NAME\" also fetches it): the same points, with the options that the "
    "instrument used, and a report that lists its decisions. SESSION may be a recording of it. "
    "\"vergence --connect ADDRESS help measure\" explains the instrument's options (fit, density, "
    "zoom, at, near, far, quick, plan).\n"
    "Options are those of \"vergence reconstruct\" and replace the instrument's. The results are "
    "in SESSION-surface, in the working directory, unless --out names another.\n"
    "A board or a length in view (--board, --length) shows what no scene of unknown size can: with "
    "it the summary states the common error without and with it, as in \"3.1 -> 0.8 mm\".\n"
    "Exit codes: as of \"vergence reconstruct\"; 3 also for a session that was not taken by "
    "measure.";

int refuse(int code, const std::string &text) {
    message line{};
    message_set(&line, 0, "%s", text.c_str());
    std::fprintf(stderr, "vergence measure: %s\n", line.text);
    return code;
}

/// Adds the instrument's words ("pair=3 near=1568.000") as options of the command line. A session
/// may come from anywhere: only options that decide the surface are taken, without its depths if
/// others are given. False: there is another one, or a value that an instrument does not write.
bool add_noted(const char *words, bool with_depths, std::vector<std::string> *line) {
    char text[MESSAGE_BYTES];
    command_text why = command_text_begin(text, sizeof text);
    const command_parser parser = {"measure", reconstruct_arguments, RECONSTRUCT_SHARED, "", &why};
    command_value values[RECONSTRUCT_SHARED] = {};
    std::vector<std::string> noted;
    std::istringstream stream(words);
    for (std::string word; stream >> word;) {
        noted.push_back(word);
    }
    for (const std::string &word : noted) {
        const char *const one[] = {word.c_str()};
        std::size_t at = 0;
        if (command_parse_option(&parser, one, 1, &at, values) != ERROR_OK) {
            return false;
        }
        const std::string name = word.substr(0, word.find('='));
        const command_argument *option =
            std::find_if(reconstruct_arguments, reconstruct_arguments + RECONSTRUCT_SHARED,
                         [&](const command_argument &argument) { return name == argument.name; });
        if (!with_depths && (name == "near" || name == "far")) {
            continue;
        }
        if (option->kind != COMMAND_FLAG) {
            line->insert(line->end(), {"--" + name, word.substr(name.size() + 1)});
        } else if (command_is_set(&values[option - reconstruct_arguments])) {
            line->push_back("--" + name);
        }
    }
    reconstruct_request request = reconstruct_request_defaults();
    command_store(reconstruct_arguments, RECONSTRUCT_SHARED, values, &request);
    return reconstruct_request_check_search(&request) == nullptr;
}

/// Adds the user's options for the surface, as they were given: all but the operand and our own.
void add_given(int argc, char **argv, const char *session, std::vector<std::string> *line) {
    for (int i = 1; i < argc; i++) {
        const std::string word = argv[i], name = word.substr(0, word.find('='));
        const bool own = std::any_of(std::begin(own_options), std::end(own_options),
                                     [&](const command_argument &option) {
                                         return name == std::string("--") + option.name;
                                     });
        if (own) {
            i += name == word;  // its value is the next word
        } else if (argv[i] != session) {
            line->push_back(word);
        }
    }
}

/// SESSION:N, of the options as noted; the last pair if they do not state one.
std::string pair_of(const std::string &session, const std::vector<std::string> &line) {
    const auto option = std::find(line.begin(), line.end(), "--pair");
    return option + 1 < line.end() ? session + ":" + *(option + 1) : session;
}

/// "" when the options are as they must be.
std::string check_size(const request &asked, calib::board *board) {
    const bool from = asked.from[0] >= 0, to = asked.to[0] >= 0, length = asked.length > 0;
    if (length != from || length != to) {
        return "--length MM requires --from and --to, and they require it";
    }
    if (length && asked.board.corners != nullptr) {
        return "--length and --board cannot be combined";
    }
    const bool parts =
        asked.board.square > 0 || asked.board.marker > 0 || asked.board.dictionary != nullptr;
    return asked.board.corners != nullptr || parts ? calibrate_board_make(asked.board, board) : "";
}

/// Finds the board or the marks in the pictures of SESSION:N. False with one sentence.
bool find_size(const request &asked, const calib::board &board, const std::string &pair,
               known_size *known, std::string *error) {
    calibrate_names names;
    calibrate_inputs inputs;
    if (!calibrate_names_expand({pair}, asked.length > 0, &names, error) ||
        !calibrate_names_pair(names, false, &inputs, error)) {
        return false;
    }
    if (inputs.shots.size() != 1 || inputs.shots[0].state == nullptr) {
        *error = pair + ": no such pair";
        return false;
    }
    calibrate_views views;
    if (asked.length > 0) {
        touch_up_marks marks;
        marks.length_mm = asked.length;
        std::copy(asked.from, asked.from + 4, marks.mark[0].begin());
        std::copy(asked.to, asked.to + 4, marks.mark[1].begin());
        views = touch_up_views(marks, inputs.shots);
    } else {
        const std::unique_ptr<workers, void (*)(workers *)> threads(
            workers_create(asked.surface.threads), workers_destroy);
        calibrate_views_request search;
        search.board = board;
        search.threads = workers_parallel(threads.get());
        views = calibrate_views_find(inputs.shots, search);
        *error = calibrate_rejection_text(views);
    }
    *known = known_size_find(inputs.shots[0], views.seen.target, views.seen.captures[0]);
    if (error->empty() && !known->is_enough()) {
        *error = pair + ": too few corners of the board in both pictures";
    }
    return error->empty();
}

/// The operand as a path: after "--" its name may begin like an option.
std::string path_of(const char *operand) {
    return operand[0] == '-' ? std::string("./") + operand : operand;
}

std::string out_of(std::string session) {
    while (session.size() > 1 && session.back() == '/') {
        session.pop_back();
    }
    return report_text_file_name(session) + "-surface";
}

/// Adds what the session's notes say of its surface. "": they are as they must be.
std::string read_noted(const char *session, bool with_depths, std::vector<std::string> *line) {
    const auto notes = std::make_unique<session_notes>();
    message why{};
    const int got = session_notes_read(AT_FDCWD, session, notes.get(), &why);
    if (got < 0) {
        return why.text;
    }
    if (got == 0) {
        return std::string(session) + ": was not taken by measure: use vergence reconstruct";
    }
    if (notes->surface[0] == '\0') {
        return std::string(session) +
               ": measure ended before its surface: use vergence reconstruct for its pairs";
    }
    return add_noted(notes->surface, with_depths, line)
               ? ""
               : std::string(session) + ": noted by another version of measure, or damaged (\"" +
                     notes->surface + "\"): use vergence reconstruct";
}

}  // namespace

int command_measure(int argc, char **argv,
                    int (*reconstruct)(int argc, char **argv, const adjust_target *target)) {
    const std::vector<command_argument> options = options_of();
    const option_page page = {"vergence measure",
                              "SESSION",
                              "make the surface of a measurement of an instrument",
                              description,
                              "vergence measure cylinder\n"
                              "vergence measure cylinder --out fine --preset best",
                              options.data(),
                              static_cast<unsigned>(options.size()),
                              1,
                              1};
    request asked{};
    asked.surface = reconstruct_request_defaults();
    asked.from[0] = asked.to[0] = -1;  // not given
    const char *session = nullptr;
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &session, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    calib::board board;
    std::string wrong = check_size(asked, &board);
    if (!wrong.empty()) {
        return refuse(CLIENT_USAGE, wrong + "; see \"vergence measure --help\"");
    }
    if (reconstruct == nullptr) {
        return OPTIONS_CONTINUE;
    }
    const std::string path = path_of(session);
    std::vector<std::string> line = {"reconstruct", path, "--out", out_of(path)};
    const double *depth_mm = asked.surface.depth_mm;
    wrong = read_noted(session, !(depth_mm[0] > 0 || depth_mm[1] > 0), &line);
    if (!wrong.empty()) {
        return refuse(CLIENT_BAD_INPUT, wrong);
    }
    known_size known;
    adjust_target target{};
    const bool sized = asked.board.corners != nullptr || asked.length > 0;
    if (sized && !find_size(asked, board, pair_of(path, line), &known, &wrong)) {
        return refuse(CLIENT_BAD_INPUT, wrong);
    }
    target = known.target();
    add_given(argc, argv, session, &line);
    std::vector<char *> words;
    for (std::string &word : line) {
        words.push_back(&word[0]);
    }
    words.push_back(nullptr);
    return reconstruct(static_cast<int>(words.size()) - 1, words.data(), sized ? &target : nullptr);
}
