// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdio>

#include "daemon/cli/options.h"
#include "tools/host/calibrate/board_pdf.hpp"
#include "tools/host/capture/capture_job.hpp"
#include "tools/host/commands/commands.hpp"

namespace {

struct request {
    calibrate_board_request board;
    const char *connect, *token;
    int zooms = 13, positions = 12, focus = 0;
    double f_number = 8, baseline = 250;
    double range[2] = {800, 2400};
    bool no_sweep, no_noise, keep_window;
};

const command_argument options[] = {
    text_option("board", offsetof(request, board.corners), "COLUMNSxROWS",
                "Inner corners of the board, as for \"vergence calibrate\". Required."),
    number_option("square", COMMAND_NUMBER, offsetof(request, board.square), "MM",
                  "Side of one square in mm. Required. 24 mm suit a 10x zoom: such squares are "
                  "large enough at the wide end, and enough of them fit at the long one.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    text_option("charuco", offsetof(request, board.dictionary), "DICT",
                "The dictionary of the markers, as in 4x4_50. Required: long zooms see only a part "
                "of the board."),
    number_option("marker", COMMAND_NUMBER, offsetof(request, board.marker), "MM",
                  "Side of a marker in mm, including its black border. Required.",
                  calibrate_board_side_min, calibrate_board_side_max, 0, 0, "mm"),
    text_option("connect", offsetof(request, connect), "ADDRESS",
                "The instrument, as for \"vergence --connect\". Default: this user's vergenced, "
                "else the system's."),
    text_option("token", offsetof(request, token), "FILE",
                "File with the token for tcp:HOST:PORT, if not the default one."),
    number_option("zooms", COMMAND_INTEGER, offsetof(request, zooms), "N",
                  "Number of zooms, equally spaced in the logarithm of the focal length. Default: "
                  "13.",
                  2, 32, 1, 0),
    number_option("positions", COMMAND_INTEGER, offsetof(request, positions), "N",
                  "Number of positions of the board, in all runs together. Default: 12.", 1, 1000,
                  1, 0),
    number_option("near", COMMAND_NUMBER, offsetof(request, range[0]), "MM",
                  "Distance from which on positions are proposed. Default: 800.", 100, 100000, 0, 0,
                  "mm"),
    number_option("far", COMMAND_NUMBER, offsetof(request, range[1]), "MM",
                  "Distance up to which positions are proposed. Default: 2400.", 100, 100000, 0, 0,
                  "mm"),
    number_option("f-number", COMMAND_NUMBER, offsetof(request, f_number), "N",
                  "The iris for all pictures. Default: 8.", 0.5, 64, 0, 0, "f/"),
    number_option("baseline", COMMAND_NUMBER, offsetof(request, baseline), "MM",
                  "Distance between the cameras, roughly, for the drawing. Default: 250.", 1, 1e5,
                  0, 0, "mm"),
    choice_option("focus", offsetof(request, focus), "HOW",
                  "autofocus: at the longest zoom of each position, where focus matters most; "
                  "distance: by the lens's distance scale. Default: autofocus.",
                  "autofocus distance"),
    flag_option("no-sweep", offsetof(request, no_sweep),
                "Take no additional pairs at other pan angles."),
    flag_option("no-noise", offsetof(request, no_noise),
                "Take no still frames for the corner noise."),
    flag_option(
        "keep-window", offsetof(request, keep_window),
        "Use the window that is set. Default: the whole sensor, which stays set, where a window "
        "can be set."),
};

const option_page page = {
    "vergence calibrate capture",
    "DIR",
    "take the pictures for a calibration at all zooms",
    "Guides through the positions of one coded board; the instrument does the rest: at each "
    "position it steps through all zooms at which both cameras see at least 12 corners, focuses, "
    "exposes so that white stays below 80 %, reads the positions of the lenses 16 times, and "
    "captures. Each position is also seen at two other pan angles at the widest zoom, as a servo "
    "is "
    "known only as well as the mean of its rests. Nothing else may move at a position.\n"
    "The longest zoom is the last that its motor reaches from the side from which it always comes "
    "(the profile's lens_zoom_approach and lens_zoom_backlash): beyond it the gears' play shows.\n"
    "At the first position 30 still frames show the noise of a corner, which the calibration then "
    "states apart from the errors of its model; how long they take is printed first.\n"
    "First the lenses are driven to both ends of the zooms. A saved calibration is not used.\n"
    "DIR becomes an ordinary session of all pairs, with corners.vnl (the corners, in mrcal's "
    "format) and guide.svg, which shows what is covered and where to place the board next: open it "
    "in a browser and reload it. Enter takes the position, q ends; after Ctrl-C or an error the "
    "same command continues with the next position.\n"
    "Positions are from the point between the cameras: away along the view, right, and down.\n"
    "Exit codes: 0 ended or complete; 3 no instrument, or it failed, or another board, "
    "window or instrument than before; 130 see \"vergence --help\".",
    "vergence calibrate capture zooms --board 10x7 --square 24 --charuco 4x4_50 --marker 17\n"
    "vergence calibrate zooms --board 10x7 --square 24 --charuco 4x4_50 --marker 17 --corners "
    "zooms/corners.vnl",
    options,
    sizeof options / sizeof options[0],
    1,
    1,
};

}  // namespace

int command_capture(int argc, char **argv) {
    request asked{};
    const char *path = nullptr;
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &path, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    capture_job job;
    std::string error = calibrate_board_make(asked.board, &job.board);
    if (error.empty() && !job.board.coded()) {
        error = "give --charuco and --marker: long zooms see only a part of the board";
    }
    if (error.empty() && asked.range[0] >= asked.range[1]) {
        error = "--near must be below --far";
    }
    if (!error.empty()) {
        std::fprintf(stderr, "vergence calibrate capture: %s\n", error.c_str());
        return CLIENT_USAGE;
    }
    job.address = asked.connect;
    job.token = asked.token;
    job.path = path;
    job.zooms = asked.zooms;
    job.positions = asked.positions;
    job.f_number = asked.f_number;
    job.baseline_mm = asked.baseline;
    job.near_mm = asked.range[0];
    job.far_mm = asked.range[1];
    job.autofocus = asked.focus == 0;
    job.sweep = !asked.no_sweep;
    job.noise = !asked.no_noise;
    job.keep_window = asked.keep_window;
    return capture_job_run(job);
}
