// SPDX-License-Identifier: Apache-2.0
/// Which pictures a calibration is made from, and which of them belong together. Only names are
/// looked at here, no picture is opened.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_INPUTS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_INPUTS_HPP

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "daemon/session/calibration_match.h"

/// One moment: the pictures of the left (0) and of the right camera (1), "" where there is none.
struct calibrate_shot {
    std::array<std::string, 2> path;
    bool mosaic = false;  // they are raw, as a session of a rig with raw sensors holds them
    /// What they were taken with; null for pictures that are of no session.
    std::shared_ptr<const calibration_match_state> state = nullptr;
};

struct calibrate_inputs {
    std::vector<calibrate_shot> shots;  // in the order of their numbers
    std::vector<std::string> notes;     // one line each: what was left out or has no partner
};

/// A picture that an operand stands for.
struct calibrate_picture {
    std::string path;
    size_t group;       // pictures of one folder, pattern or list have the same
    bool spread_group;  // the group is a folder, a pattern or a list, no single picture
};

/// What the operands stand for: names, not yet put together.
struct calibrate_names {
    std::vector<calibrate_picture> pictures;
    std::vector<calibrate_shot> shots;  // that a list or a session puts together itself
    std::vector<std::string> notes;
};

/// Expands folders (with `left/` and `right/` in them, or not), recorded sessions and folders of
/// them, patterns, and lists (text with one or two names a line, or OpenCV's image lists in XML or
/// YAML). Returns false with one sentence in `*error` when an operand stands for nothing, or a
/// session is damaged.
bool calibrate_names_expand(const std::vector<std::string> &operands, calibrate_names *names,
                            std::string *error);

/// Puts together what has the same number or name. `single`: there is but one camera. Returns false
/// with one sentence in `*error` when nothing can be put together.
bool calibrate_names_pair(const calibrate_names &names, bool single, calibrate_inputs *inputs,
                          std::string *error);

#endif
