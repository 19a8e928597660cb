// SPDX-License-Identifier: Apache-2.0
/// Corners in a file, in the form that mrcal and mrgingham use (a vnlog, "# filename x y level"):
/// `mrcal-calibrate-cameras --corners-cache` reads what is written here, and mrgingham's output is
/// read.
///
/// A level L stands for a weight of 2^-L. Here it need not be a whole number, and a comment says
/// which standard deviation level 0 has; mrcal cuts levels down to whole numbers.
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

/// Writes all views; one without corners becomes a line of dashes. False, with one sentence in
/// `*error`, when a name cannot be written (it is empty, holds white space or begins with '#') or
/// the stream fails.
bool corner_cache_write(std::ostream &out, const board &board,
                        const std::vector<cached_view> &views, std::string *error);

/// Reads all views in the order of the file. A file that does not say what level 0 means gets a
/// standard deviation of 0.1 px there. False, with one sentence in `*error` and `*views`
/// untouched, when the text does not follow the form or an image has another number of corners than
/// `board`.
bool corner_cache_read(std::istream &in, const board &board, std::vector<cached_view> *views,
                       std::string *error);

}  // namespace calib

#endif
