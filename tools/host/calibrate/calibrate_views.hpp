// SPDX-License-Identifier: Apache-2.0
/// From pictures to what both cameras saw of the board: reads them, searches corners on all cores,
/// and leaves out unusable ones with a reason.
#ifndef VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_VIEWS_HPP
#define VERGENCE_TOOLS_HOST_CALIBRATE_CALIBRATE_VIEWS_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "calib/base/corner_cache.hpp"
#include "calib/solve/solve.hpp"
#include "core/parallel.h"
#include "tools/host/calibrate/calibrate_inputs.hpp"

constexpr const char *side_name[] = {"left", "right"};

/// A picture in memory, upright, in grey. Larger ones than the core's images are shrunk.
struct calibrate_image {
    std::vector<uint8_t> grey;
    int width_px = 0, height_px = 0;            // size of `grey`
    int file_width_px = 0, file_height_px = 0;  // size as displayed, before shrinking
    int shrink = 1;
    int full_scale = 255;  // grey of the file's brightest possible value
    int orientation = 0;   // EXIF numbering, 0 or 1: not turned
};

/// Returns false with one sentence in `*error` that names the file. `mosaic`: a grey file is a
/// mosaic with rows G R and B G.
bool calibrate_image_read(const std::string &path, bool mosaic, calibrate_image *image,
                          std::string *error);

/// Restores the original size of a picture that was shrunk, by repeating pixels.
void calibrate_image_enlarge(calibrate_image *image);

/// A picture that does not count, and why.
struct calibrate_rejection {
    size_t shot;
    int camera;
    std::string reason;  // does not name the picture
};

struct calibrate_views {
    /// Board positions in the order of the shots, named without the folder common to all.
    calib::observations seen;
    std::vector<calibrate_rejection> rejections;
    int pictures = 0, boards = 0;  // named pictures, pictures with a usable board
    int pairs = 0;                 // shots with a usable board in both pictures
};

struct calibrate_views_request {
    calib::board board;
    bool single = false;
    std::vector<calib::cached_view> cache;  // known corners, which need not be searched
    const parallel *threads = nullptr;
    /// Called with the number of finished pictures, from any thread but never concurrently; may be
    /// empty.
    std::function<void(int done, int total)> progress;
    std::function<bool()> cancelled;  // called often, from any thread; may be empty
};

/// Processes all shots; there must be at least one. After a cancellation the result is undefined.
calibrate_views calibrate_views_find(const std::vector<calibrate_shot> &shots,
                                     const calibrate_views_request &request);

/// Explains why too few pictures can be used: the most common reason and a hint.

/// One line with the reason why nothing can be solved from these views; "" if the solver should
/// try.
std::string calibrate_rejection_text(const calibrate_views &views);

/// The board size that a reason says was found instead of the requested one. False if the reason
/// says something else.
bool calibrate_rejection_size(const std::string &reason, int *columns, int *rows);

#endif
