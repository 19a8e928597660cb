// SPDX-License-Identifier: Apache-2.0
/// One picture of all disparity maps.
#ifndef VERGENCE_TESTS_BENCH_BENCH_SHEET_HPP
#define VERGENCE_TESTS_BENCH_BENCH_SHEET_HPP

#include <string>
#include <vector>

#include "bench/harness/bench_run.hpp"

/// For each pair: the left image, the truth, our map and that of OpenCV's best mode, in the colours
/// of the truth's range. Black: rejected, or unknown.
class bench_sheet {
  public:
    /// Of ours the map of "best", or the first. Pairs without truth, or without both maps, are left
    /// out.
    void add(const bench_pair &pair, const std::vector<bench_outcome> &outcomes);

    /// Writes a JPEG, or what the name's end says. Throws when the file cannot be written.
    void write(const std::string &path) const;

  private:
    std::vector<cv::Mat> blocks_;
};

#endif
