// SPDX-License-Identifier: Apache-2.0
/// One picture of all disparity maps.
#ifndef VERGENCE_TESTS_BENCH_BENCH_SHEET_HPP
#define VERGENCE_TESTS_BENCH_BENCH_SHEET_HPP

#include <string>
#include <vector>

#include "bench/harness/bench_run.hpp"

/// For each pair our map and that of OpenCV's best mode, in the colours of the truth's range, black
/// where rejected; beside each its errors: white within 1 px, orange above, red above 3 px, light
/// grey rejected, grey not counted (occluded or unknown). The pair's own pixels are not shown.
class bench_sheet {
  public:
    /// Of ours the map of "best", or the first. Pairs without truth, or without both maps, are left
    /// out.
    void add(const bench_pair &pair, const std::vector<bench_outcome> &outcomes);

    /// Writes WebP, JPEG or PNG, as the name ends. Throws when the file cannot be written.
    void write(const std::string &path) const;

  private:
    std::vector<cv::Mat> blocks_;
};

#endif
