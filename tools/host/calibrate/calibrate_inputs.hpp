// SPDX-License-Identifier: Apache-2.0
/// Which pictures a calibration is made from, and which of them form pairs. Looks at names only and
/// opens no picture.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_INPUTS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_INPUTS_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "console/pair/calibration_match.h"
#include "daemon/session/session_pairs.h"

/// One moment: the pictures of the left (0) and of the right camera (1), "" if missing.
struct calibrate_shot {
    std::array<std::string, 2> path;
    bool mosaic = false;  // raw, as in a session of a rig with raw sensors
    /// The capture data; null for pictures that do not belong to a session.
    std::shared_ptr<const calibration_match_state> state = nullptr;
    std::array<bool, 2> missing = {false, false};  // the session has no such frame any more
    size_t session = 0;                            // number of the session, from 1; 0: none
    uint32_t number = 0;                           // number of the pair in the session, from 1
    /// Of the board and of the pans, as in session_pairs.h; 0: not recorded.
    uint32_t board_position = 0, pan_visit = 0;
    bool focused_on_board = false;
    session_corner_noise corner_noise{};
};

struct calibrate_inputs {
    std::vector<calibrate_shot> shots;  // ordered by their numbers
    std::vector<std::string> notes;     // one line each: what was left out or has no partner
};

/// A picture that an operand stands for.
struct calibrate_picture {
    std::string path;
    size_t group;       // the same for all pictures of one folder, pattern or list
    bool spread_group;  // the group is a folder, a pattern or a list, not a single picture
};

/// What the operands stand for: names, not yet paired.
struct calibrate_names {
    std::vector<calibrate_picture> pictures;
    std::vector<calibrate_shot> shots;  // paired by a list or a session
    std::vector<std::string> notes;
    size_t sessions = 0;
};

/// Expands folders (with `left/` and `right/` in them, or not), recorded sessions and folders of
/// them, SESSION:N for one of its pairs, patterns, and lists (text with one or two names per line,
/// or OpenCV's image lists in XML or YAML). `frames_may_miss`: corners are known, so that sessions
/// need no frames. Returns false with one sentence in `*error` when an operand matches nothing or a
/// session is damaged.
bool calibrate_names_expand(const std::vector<std::string> &operands, bool frames_may_miss,
                            calibrate_names *names, std::string *error);

/// Pairs pictures with the same number or name. `single`: there is only one camera. Returns false
/// with one sentence in `*error` when nothing can be paired.
bool calibrate_names_pair(const calibrate_names &names, bool single, calibrate_inputs *inputs,
                          std::string *error);

#endif
