// SPDX-License-Identifier: Apache-2.0
/// Runs the matcher on a synthetic pair and compares the result with the truth.
#ifndef VERGENCE_TESTS_SYNTHETIC_MATCHED_HPP
#define VERGENCE_TESTS_SYNTHETIC_MATCHED_HPP

#include <cstdint>
#include <functional>
#include <vector>

#include "stereo/image/reason.h"
#include "stereo/match/match.h"
#include "synthetic/pair.hpp"

namespace synthetic {

/// Memory with the arena's alignment, of exactly the requested size.
class Memory {
  public:
    explicit Memory(size_t size_bytes);
    ~Memory();
    Memory(const Memory &) = delete;
    Memory &operator=(const Memory &) = delete;
    void *data() const { return data_; }
    size_t size() const { return size_bytes_; }

  private:
    void *data_;
    size_t size_bytes_;
};

/// Images, spans and outputs of one match, with a common lifetime.
struct Matched {
    int width, height;
    std::vector<uint8_t> left, right;  // pixels, including those between width and stride
    match_input input{};
    std::vector<int32_t> disparity_q8;
    std::vector<uint8_t> reason, confidence;
    match_output output;
    int status;
    size_t peak_bytes, need_bytes;

    size_t index(int x, int y) const {
        return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
    }
    double disparity_px(size_t i) const { return disparity_q8[i] / 256.0; }
    bool valid(size_t i) const { return reason[i] == REASON_VALID; }
    double share(int of_reason) const;  // share of all pixels

    /// Points the views at this object's own vectors; call it on a copy.
    void bind();
};

struct MatchSetting {
    const struct parallel *parallel = &parallel_serial;
    int stride_extra = 0;
    std::function<bool(int rows_done, int rows)> progress;
    size_t memory_bytes = 0;  // 0: the result of match_needs
};

/// Matches; the caller checks `status`. The arena is exactly as large as the matcher requested.
Matched run_match(const Pair &pair, const match_options &options, const MatchSetting &setting = {});
Matched run_match(const std::vector<uint8_t> &left, const std::vector<uint8_t> &right, int width,
                  int height, const match_options &options, const MatchSetting &setting = {});

/// Statistics of a result against the truth, over the pixels selected by `counts(x, y)`.
struct Comparison {
    int pixels = 0;                  // selected pixels
    int valid = 0;                   // valid pixels among the selected
    int bad_1px = 0, bad_2px = 0;    // valid pixels with |error| > 1 px, > 2 px
    double bias_px = 0, rms_px = 0;  // mean and RMS error of the valid pixels within 1 px
    double valid_share() const { return pixels > 0 ? static_cast<double>(valid) / pixels : 0; }
    double bad_1px_share() const { return valid > 0 ? static_cast<double>(bad_1px) / valid : 0; }
    double bad_2px_share() const { return valid > 0 ? static_cast<double>(bad_2px) / valid : 0; }
};
Comparison compare(const Matched &matched, const ViewTruth &truth,
                   const std::function<bool(int x, int y)> &counts);

/// Seen by both cameras, at least `border` px from the image's border, and no other surface within
/// `radius` px.
std::vector<bool> clear_pixels(const Pair &pair, int radius, int border);

}  // namespace synthetic

#endif
