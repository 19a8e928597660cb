// SPDX-License-Identifier: Apache-2.0
#include "tools/host/calibrate/calibrate_rejection.hpp"

#include <algorithm>
#include <cstdio>
#include <map>

namespace {

const char *const is_it_the_board = "does --board count inner corners, and is it the right board?";
const char *const are_markers_right =
    "is --marker the side of a marker including its black border, and --charuco its dictionary?";
const char *const whole_in_both =
    "both must see the whole board (a coded one in part) at the same time";
const char *const whole_board = "the whole plain board must be visible";
const char *const no_mirror = "switch mirroring off (webcam previews do it) and take them again";

/// The hint for a reason that contains these words.
struct advice {
    const char *words;
    const char *no_board;  // where no picture shows a board
    const char *no_pair;   // where boards were found, but by one camera at a time
};

const advice table[] = {
    {" corners, not ", is_it_the_board, is_it_the_board},
    {"do not fit a coded board", is_it_the_board, is_it_the_board},
    {"too few readable markers", are_markers_right, are_markers_right},
    {"not of dictionary", are_markers_right, are_markers_right},
    {"read backwards", no_mirror, no_mirror},
    {"left and right are the same", "", "name the pictures of both cameras, or give --single"},
    {"no board found: ", "", ""},  // followed by what is wrong
    {"no board found", is_it_the_board, whole_in_both},
    {"is cut off", whole_board, whole_in_both},
    {" corners visible", whole_board, whole_in_both},
};

std::string advice_for(const std::string &reason, bool no_board) {
    if (reason.empty()) {
        return whole_in_both;
    }
    for (const advice &one : table) {
        if (reason.find(one.words) != std::string::npos) {
            return no_board ? one.no_board : one.no_pair;
        }
    }
    return "";
}

/// Reasons that differ only in a name are merged.
std::string without_names(const std::string &reason) {
    const std::string same = "the same picture as ";
    return reason.compare(0, same.size(), same) == 0 ? same + "another one" : reason;
}

/// The reason for which most pictures were rejected, and how many; 0 when none was rejected.
std::pair<std::string, int> commonest(const calibrate_views &views) {
    std::map<std::string, int> count;
    for (const calibrate_rejection &one : views.rejections) {
        count[without_names(one.reason)]++;
    }
    const auto max = std::max_element(count.begin(), count.end(), [](const auto &a, const auto &b) {
        return a.second < b.second;
    });
    return max == count.end() ? std::pair(std::string(), 0) : std::pair(max->first, max->second);
}

}  // namespace

std::string calibrate_rejection_text(const calibrate_views &views) {
    const bool no_board = views.boards == 0;
    if (!no_board && (views.seen.cameras == 1 || views.pairs > 0)) {
        return "";
    }
    const auto [reason, count] = commonest(views);
    std::string text = no_board ? "no picture shows a board of " +
                                      std::to_string(views.seen.target.columns) + " x " +
                                      std::to_string(views.seen.target.rows) + " corners"
                                : "no board was seen by both cameras at the same moment";
    if (count > 0) {
        text += ": " + reason + " (" + std::to_string(count) + " of " +
                std::to_string(views.pictures) + " pictures)";
    }
    const std::string help = advice_for(reason, no_board);
    return text + (help.empty() ? "" : "; " + help);
}

bool calibrate_rejection_size(const std::string &reason, int *columns, int *rows) {
    int length = 0;
    // As worded by the detector.
    return std::sscanf(reason.c_str(), "found %d x %d corners, not %n", columns, rows, &length) ==
               2 &&
           length > 0;
}
