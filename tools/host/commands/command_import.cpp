// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdio>
#include <new>

#include "core/error.h"
#include "core/utf8.h"
#include "daemon/base/process.h"
#include "daemon/cli/options.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/recordings/recording_import.hpp"

namespace {

constexpr int pairs_max = 1000000;

struct request {
    const char *out = nullptr, *calibration = nullptr, *topics = nullptr;
    bool side_by_side = false, rectified = false, quiet = false;
    int every = 1, pairs = 0;
    double tolerance_ms = 5;
};

const command_argument options[] = {
    text_option("out", offsetof(request, out), "SESSION",
                "The new session's directory. Required; it must not exist."),
    text_option("calibration", offsetof(request, calibration), "FILE",
                "The cameras' calibration, of any format of \"vergence info\", or \"none\". "
                "Default: that of the recording."),
    text_option(
        "topics", offsetof(request, topics), "LEFT,RIGHT",
        "MCAP, bags: the topics of the images. Default: the only two whose names differ by left "
        "and right, infra1 and infra2, or cam0 and cam1."),
    flag_option("side-by-side", offsetof(request, side_by_side),
                "An image, a directory of images or a video (by the program ffmpeg) has both views "
                "in its halves, the left one on the left, as ZED and StereoPi record them."),
    flag_option(
        "rectified", offsetof(request, rectified),
        "The images are rectified: use the rectified cameras of the calibration. For topics "
        "with rect in their name this is the default."),
    number_option("every", COMMAND_INTEGER, offsetof(request, every), "N",
                  "Take one of every N pairs.", 1, pairs_max),
    number_option("pairs", COMMAND_INTEGER, offsetof(request, pairs), "N", "Take at most N pairs.",
                  1, pairs_max),
    number_option("tolerance", COMMAND_NUMBER, offsetof(request, tolerance_ms), "MS",
                  "Largest time between the images of a pair in ms. Default: 5.", 0, 1000),
    flag_option("quiet", offsetof(request, quiet), "Print only errors."),
};

const option_page page_of_command = {
    "vergence import",
    "RECORDING",
    "take pairs that another program recorded into a session",
    "Reads RECORDING and writes its stereo pairs, with their times and calibration, as a session "
    "that \"vergence reconstruct\", \"view\", \"info\" and \"export\" take. RECORDING is\n"
    "an MCAP file or a bag of ROS 1, or a directory with some: sensor_msgs/Image or "
    "CompressedImage of two topics, and camera_info beside them (of a bag that was not closed, "
    "FILE.bag.active, what is whole);\n"
    "a directory of EuRoC or TUM VI (mav0/cam0/data), of KITTI (image_02/data, image_2), or with "
    "folders left and right, whose images have equal names, or times in seconds or nanoseconds as "
    "names;\n"
    "with --side-by-side an image, a directory of images, or a video.\n"
    "All pairs are written, or none. Exit code: 0 OK; 1 writing failed; 2 invalid command line; 3 "
    "no pairs in it, no calibration, or damaged.",
    "vergence export files/scene --calibration rig.txt --mcap scene.mcap\n"
    "vergence import scene.mcap --out drive\n"
    "vergence import scene.mcap --topics /left/image_raw,/right/image_raw --every 20 --out few\n"
    "vergence import zed.png --side-by-side --calibration rig.txt --out zed",
    options,
    sizeof options / sizeof options[0],
    1,
    1,
};

int refuse(int code, const std::string &text) {
    char line[MESSAGE_BYTES];  // the text may name a topic of a damaged file
    utf8_copy_printable(text.c_str(), line, sizeof line);
    std::fprintf(stderr, "vergence import: %s\n", line);
    return code;
}

}  // namespace

int command_import(int argc, char **argv) {
    request asked;
    const char *path = nullptr;
    int count = 0;
    const int parsed = options_parse(&page_of_command, argc, argv, &asked, &path, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    if (asked.out == nullptr) {
        return refuse(CLIENT_USAGE, "--out SESSION is missing; see vergence import --help");
    }
    interrupt_catch();
    try {
        const auto text = [](const char *value) {
            return std::string(value != nullptr ? value : "");
        };
        const int pairs = recording_import(
            {{path, text(asked.topics), asked.side_by_side, asked.tolerance_ms / 1000},
             asked.out,
             text(asked.calibration),
             asked.rectified,
             asked.every,
             asked.pairs});
        if (!asked.quiet) {
            std::printf("written: %s (%d pair%s)\n", asked.out, pairs, pairs == 1 ? "" : "s");
        }
        return CLIENT_OK;
    } catch (const import_failure &failure) {
        // A file that cannot be read or written says nothing about the input.
        const bool failed = failure.code == ERROR_IO;
        return refuse(failed ? CLIENT_FAILED : options_exit_code(failure.code), failure.message);
    } catch (const std::bad_alloc &) {
        return refuse(CLIENT_FAILED, std::string(path) + ": out of memory");
    }
}
