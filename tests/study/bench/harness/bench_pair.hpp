// SPDX-License-Identifier: Apache-2.0
/// Rectified pairs with ground truth, as folders on the disk.
#ifndef VERGENCE_TESTS_BENCH_BENCH_PAIR_HPP
#define VERGENCE_TESTS_BENCH_BENCH_PAIR_HPP

#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

/// Added to the number of a region where the rendered image has texture along the row.
enum { BENCH_REGION_TEXTURED = 128 };

struct bench_pair {
    std::string name;
    cv::Mat left, right;                // grey, 8 bit, continuous
    cv::Mat left_colour, right_colour;  // red, green, blue
    int disparity_min = 0, disparity_count = 0;
    bool round_disparity = false;  // the truth is in whole pixels: round before comparing
    std::vector<float> truth_px;   // empty: none; not finite: unknown
    std::vector<uint8_t>
        mask;                 // enum of evaluate.hpp; derived from the truth when there is no file
    std::string mask_origin;  // "mask.png" or "from the truth"
    std::string set;          // recorded pairs of one origin; its own name if not given
    std::string part;         // rendered scenes: "develop" or "check"
    std::vector<uint8_t> region;            // numbers of objects, from 1; empty: not given
    std::vector<std::string> region_names;  // names of the objects in `region`

    bool is_rendered() const { return !region_names.empty(); }
};

/// The folders to load: `path` itself if it contains left.png, else its sub-folders that do, in
/// order of their names. May be empty.
std::vector<std::string> bench_pair_folders(const std::string &path);

/// Loads left.png, right.png, meta.json (disparity_search: [min, end], optional set,
/// part) and, if present, disparity.pfm, mask.png and regions.png, the objects that meta.json
/// names (regions: ["wall", ...]). On failure returns false and the reason with the file's name.
bool bench_pair_load(const std::string &folder, bench_pair *pair, std::string *message);

/// Mask derived from the truth. A pixel is occluded when its match is outside the right image, or
/// when another pixel of the row with more than 1 px more disparity falls on the same integer right
/// column.
std::vector<uint8_t> bench_pair_mask(int width, int height, const std::vector<float> &truth_px);

#endif
