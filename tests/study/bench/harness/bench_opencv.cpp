// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_opencv.hpp"

#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/memory_count.hpp"

namespace {

constexpr int kScale = cv::StereoMatcher::DISP_SCALE;
constexpr int kSpeckleStep_px = 2;

int sgbm_mode(opencv_mode mode) {
    switch (mode) {
        case opencv_mode::three_way:
            return cv::StereoSGBM::MODE_SGBM_3WAY;
        case opencv_mode::hh4:
            return cv::StereoSGBM::MODE_HH4;
        case opencv_mode::hh:
            return cv::StereoSGBM::MODE_HH;
        default:
            return cv::StereoSGBM::MODE_SGBM;
    }
}

cv::Ptr<cv::StereoMatcher> matcher_of(const opencv_setting &setting, int disparity_count) {
    if (setting.mode == opencv_mode::block_matching) {
        cv::Ptr<cv::StereoBM> matcher = cv::StereoBM::create(disparity_count, setting.block_px);
        matcher->setPreFilterCap(setting.prefilter_cap);
        matcher->setUniquenessRatio(setting.uniqueness_percent);
        matcher->setDisp12MaxDiff(1);
        matcher->setSpeckleWindowSize(setting.speckle_px);
        matcher->setSpeckleRange(kSpeckleStep_px * kScale);  // here in 1/16 px
        return matcher;
    }
    return cv::StereoSGBM::create(0, disparity_count, setting.block_px, setting.p1(), setting.p2(),
                                  1, setting.prefilter_cap, setting.uniqueness_percent,
                                  setting.speckle_px, kSpeckleStep_px, sgbm_mode(setting.mode));
}

// A pair in OpenCV's form.
struct opencv_input {
    cv::Mat left, right;
    int disparity_min, disparity_count;
    int before_px;  // columns added on the left
    int width_px;   // width of the pair itself
};

opencv_input opencv_input_of(const bench_pair &pair) {
    opencv_input input;
    input.disparity_min = pair.disparity_min;
    input.disparity_count = (pair.disparity_count + 15) / 16 * 16;
    input.width_px = pair.left.cols;
    input.before_px = std::max(input.disparity_min + input.disparity_count, 0);
    const int after_px = std::max(-input.disparity_min, 0);
    cv::copyMakeBorder(pair.left, input.left, 0, 0, input.before_px, after_px,
                       cv::BORDER_REPLICATE);
    cv::copyMakeBorder(pair.right, input.right, 0, 0, input.before_px, after_px,
                       cv::BORDER_REPLICATE);
    return input;
}

std::vector<float> opencv_disparity_px(const cv::Mat &disparity_q4, const opencv_input &input) {
    std::vector<float> result;
    for (int y = 0; y < disparity_q4.rows; y++) {
        const int16_t *row = disparity_q4.ptr<int16_t>(y) + input.before_px;
        for (int x = 0; x < input.width_px; x++) {
            const bool valid = row[x] >= input.disparity_min * kScale;
            result.push_back(valid ? static_cast<float>(row[x]) / kScale
                                   : std::numeric_limits<float>::quiet_NaN());
        }
    }
    return result;
}

class linked_method : public bench_method {
  public:
    linked_method(const bench_pair &pair, const opencv_setting &setting)
        : input_(opencv_input_of(pair)), matcher_(matcher_of(setting, input_.disparity_count)) {
        matcher_->setMinDisparity(input_.disparity_min);
        disparity_q4_.create(input_.left.size(), CV_16S);
    }

    std::size_t first_run_bytes() override {
        set_threads(1);
        memory_count_begin();
        matcher_->compute(input_.left, input_.right, disparity_q4_);
        return memory_count_peak_bytes();
    }

    bench_time run(int threads) override {
        set_threads(threads);
        return bench_timed([this] { matcher_->compute(input_.left, input_.right, disparity_q4_); });
    }

    std::vector<float> disparity_px() override {
        return opencv_disparity_px(disparity_q4_, input_);
    }

  private:
    // Starts the threads of a new count before anything is timed.
    static void set_threads(int threads) {
        if (cv::getNumThreads() != threads) {
            cv::setNumThreads(threads);
            cv::parallel_for_(cv::Range(0, 16 * threads), [](const cv::Range &) {});
        }
    }

    opencv_input input_;
    cv::Ptr<cv::StereoMatcher> matcher_;
    cv::Mat disparity_q4_;
};

}  // namespace

const char *opencv_mode_name(opencv_mode mode) {
    switch (mode) {
        case opencv_mode::three_way:
            return "SGBM 3-way";
        case opencv_mode::sgbm:
            return "SGBM";
        case opencv_mode::hh4:
            return bench_best_mode;
        case opencv_mode::hh:
            return "SGBM HH";
        default:
            return "StereoBM";
    }
}

std::string opencv_setting_text(const opencv_setting &setting) {
    std::string text = "block " + std::to_string(setting.block_px);
    if (setting.mode != opencv_mode::block_matching) {
        text += ", P1 " + std::to_string(setting.p1()) + ", P2 " + std::to_string(setting.p2());
    }
    text += ", preFilterCap " + std::to_string(setting.prefilter_cap) + ", uniqueness " +
            std::to_string(setting.uniqueness_percent) + ", speckle ";
    return text + (setting.speckle_px > 0 ? std::to_string(setting.speckle_px) + " px" : "off");
}

opencv_setting opencv_default(opencv_mode mode) {
    switch (mode) {
        case opencv_mode::block_matching:
            return {mode, 7, 0, 31, 0, 100};
        case opencv_mode::hh4:
        case opencv_mode::hh:
            return {mode, 3, 1, 31, 10, 100};
        default:
            return {mode, 3, 1, 31, 0, 100};
    }
}

opencv_setting opencv_plain() {
    return {opencv_mode::three_way, 3, 1, 63, 0, 0};
}

std::unique_ptr<bench_method> opencv_make(const bench_pair &pair, const opencv_setting &setting) {
    return std::make_unique<linked_method>(pair, setting);
}
