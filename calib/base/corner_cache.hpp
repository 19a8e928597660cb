// SPDX-License-Identifier: Apache-2.0
/// Corners in a file, in the format of mrcal and mrgingham (a vnlog, "# filename x y level").
/// `mrcal-calibrate-cameras --corners-cache` reads what is written here, and mrgingham's output can
/// be read.
///
/// A level L means a weight of 2^-L. Here it may be fractional, and a comment states the standard
/// deviation of level 0; mrcal truncates levels to integers.
#ifndef VERGENCE_CALIB_BASE_CORNER_CACHE_HPP
#define VERGENCE_CALIB_BASE_CORNER_CACHE_HPP

#include <iosfwd>
#include <string>
#include <vector>

#include "calib/base/board.hpp"

namespace calib {

struct cached_view {
    std::string filename;
    board_view view;
};

/// Writes all views; a view without corners becomes a line of dashes. Returns false, with one
/// sentence in `*error`, when a name cannot be written (it is empty, contains white space or begins
/// with '#') or the stream fails.
bool corner_cache_write(std::ostream &out, const board &board,
                        const std::vector<cached_view> &views, std::string *error);

/// Reads all views in the order of the file. If the file does not define level 0, its standard
/// deviation is 0.1 px. Returns false, with one sentence in `*error` and `*views` untouched, when
/// the text does not have this format or an image has another number of corners than `board`.
bool corner_cache_read(std::istream &in, const board &board, std::vector<cached_view> *views,
                       std::string *error);

}  // namespace calib

#endif
