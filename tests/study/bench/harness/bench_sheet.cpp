// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_sheet.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace {

constexpr int kPictureWidth_px = 184, kPictureHeight_px = 138, kTitleHeight_px = 14, kGap_px = 2;
constexpr int kPictures = 4, kBlocksARow = 2;
constexpr int kJpegQuality = 60, kWebpQuality = 30;

struct range {
    float low, high;
};

// Without the outer hundredths.
range range_of(const std::vector<float> &truth_px) {
    std::vector<float> known;
    std::copy_if(truth_px.begin(), truth_px.end(), std::back_inserter(known),
                 [](float value) { return std::isfinite(value); });
    std::sort(known.begin(), known.end());
    const std::size_t outer = known.size() / 100;
    return known.empty() ? range{0, 1} : range{known[outer], known[known.size() - 1 - outer]};
}

// Nearest pixels, so that holes and islands keep their edges.
cv::Mat map_picture(const cv::Size &size, const std::vector<float> &disparity_px, range range) {
    cv::Mat level(size, CV_8U);
    cv::Mat rejected(size, CV_8U);
    const float scale = 255 / std::max(range.high - range.low, 1.0F);
    for (std::size_t i = 0; i < disparity_px.size(); i++) {
        const bool is_kept = std::isfinite(disparity_px[i]);
        rejected.data[i] = is_kept ? 0 : 255;
        level.data[i] =
            is_kept ? cv::saturate_cast<uint8_t>((disparity_px[i] - range.low) * scale) : 0;
    }
    cv::Mat colour;
    cv::applyColorMap(level, colour, cv::COLORMAP_TURBO);
    colour.setTo(cv::Scalar::all(0), rejected);
    return colour;
}

cv::Mat error_picture(const bench_pair &pair, const std::vector<float> &disparity_px) {
    cv::Mat picture(pair.left.size(), CV_8UC3, cv::Scalar::all(255));
    for (std::size_t i = 0; i < disparity_px.size(); i++) {
        cv::Vec3b &colour = picture.at<cv::Vec3b>(static_cast<int>(i));
        const float error_px = std::fabs(disparity_px[i] - pair.truth_px[i]);
        if (pair.mask[i] != EVALUATE_VISIBLE || !std::isfinite(pair.truth_px[i])) {
            colour = {120, 120, 120};
        } else if (!std::isfinite(disparity_px[i])) {
            colour = {210, 210, 210};
        } else if (error_px > 1) {
            colour = error_px > 3 ? cv::Vec3b{0, 0, 230} : cv::Vec3b{0, 150, 255};
        }
    }
    return picture;
}

void place(const cv::Mat &picture, int column, cv::Mat &block) {
    const double factor = std::min(static_cast<double>(kPictureWidth_px) / picture.cols,
                                   static_cast<double>(kPictureHeight_px) / picture.rows);
    cv::Mat small;
    cv::resize(picture, small, cv::Size(), factor, factor, cv::INTER_NEAREST);
    small.copyTo(block(
        cv::Rect(column * (kPictureWidth_px + kGap_px), kTitleHeight_px, small.cols, small.rows)));
}

void title(const std::string &text, int column, cv::Mat &block) {
    cv::putText(block, text, {column * (kPictureWidth_px + kGap_px), kTitleHeight_px - 4},
                cv::FONT_HERSHEY_SIMPLEX, 0.36, cv::Scalar::all(0), 1, cv::LINE_AA);
}

}  // namespace

void bench_sheet::add(const bench_pair &pair, const std::vector<bench_outcome> &outcomes) {
    const bench_outcome *ours = nullptr;
    const bench_outcome *theirs = nullptr;
    for (const bench_outcome &one : outcomes) {
        if (one.is_ours && (ours == nullptr || one.method == "best")) {
            ours = &one;
        }
        if (one.method == bench_best_mode) {
            theirs = &one;
        }
    }
    if (ours == nullptr || theirs == nullptr || pair.truth_px.empty()) {
        return;
    }
    cv::Mat block(kTitleHeight_px + kPictureHeight_px + kGap_px,
                  kPictures * (kPictureWidth_px + kGap_px), CV_8UC3, cv::Scalar::all(255));
    const range range = range_of(pair.truth_px);
    int column = 0;
    for (const bench_outcome *one : {ours, theirs}) {
        title(one == ours ? pair.name + ": " + one->method : one->method, column, block);
        place(map_picture(pair.left.size(), one->disparity_px, range), column++, block);
        place(error_picture(pair, one->disparity_px), column++, block);
    }
    blocks_.push_back(block);
}

void bench_sheet::write(const std::string &path) const {
    if (blocks_.empty()) {
        throw std::runtime_error(path + ": no pair with truth, our map and that of " +
                                 bench_best_mode);
    }
    const cv::Size block = blocks_.front().size();
    const int columns = std::min(kBlocksARow, static_cast<int>(blocks_.size()));
    const int rows = (static_cast<int>(blocks_.size()) + columns - 1) / columns;
    cv::Mat sheet(rows * block.height, columns * block.width, CV_8UC3, cv::Scalar::all(255));
    for (int i = 0; i < static_cast<int>(blocks_.size()); i++) {
        const cv::Point at(i % columns * block.width, i / columns * block.height);
        blocks_[static_cast<std::size_t>(i)].copyTo(sheet(cv::Rect(at, block)));
    }
    bool written = false;
    try {
        written = cv::imwrite(
            path, sheet,
            // WebP is without loss unless its quality comes first.
            {cv::IMWRITE_WEBP_QUALITY, kWebpQuality, cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
    } catch (const cv::Exception &) {
        // An unknown kind of file: reported below.
    }
    if (!written) {
        throw std::runtime_error(
            path + ": cannot be written (expected a name ending in .webp, .jpg or .png)");
    }
}
