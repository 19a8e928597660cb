// SPDX-License-Identifier: Apache-2.0
/// The calibration board in a picture of the view, and the calibration from captured views of it.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_BOARD_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_BOARD_HPP

#include <string>

class view_source;
struct view_picture;
struct view_settings;

/// JSON: the corners in the left and the right half, or why there are none. `columns`, `rows`:
/// inner corners of a plain board.
std::string view_board_find(const view_picture &picture, int columns, int rows);

/// Calibrates from sessions of an instrument by `vergence calibrate` and puts the calibration among
/// the instrument's files. `body`: JSON with "board" ("9x6"), "square" (mm) and "sessions". Returns
/// JSON with the paths of the report and the calibration's name there, or an error.
std::string view_board_calibrate(view_source *source, const view_settings &settings,
                                 const std::string &body);

#endif
