// SPDX-License-Identifier: Apache-2.0
#include "bench/bench_method.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/bench_ours.hpp"

namespace {

constexpr int kScale = cv::StereoMatcher::DISP_SCALE;

class opencv_method : public bench_method {
  public:
    opencv_method(const bench_pair &pair, const bench_setting &setting,
                  const std::function<cv::Ptr<cv::StereoMatcher>(int count)> &make)
        : setting_(setting),
          disparity_min_(pair.disparity_min),
          width_(pair.left.cols),
          // OpenCV wants a multiple of 16; searching a few more is its own affair.
          matcher_(make((pair.disparity_count + 15) / 16 * 16)) {
        matcher_->setMinDisparity(pair.disparity_min);
        const int end = pair.disparity_min + matcher_->getNumDisparities();
        before_ = setting.padded ? std::max(end, 0) : 0;
        const int after = setting.padded ? std::max(-pair.disparity_min, 0) : 0;
        cv::copyMakeBorder(pair.left, left_, 0, 0, before_, after, cv::BORDER_REPLICATE);
        cv::copyMakeBorder(pair.right, right_, 0, 0, before_, after, cv::BORDER_REPLICATE);
        disparity_.create(left_.size(), CV_16S);
    }

    void run() override {
        cv::setNumThreads(setting_.threads);
        matcher_->compute(left_, right_, disparity_);
    }

    std::vector<float> disparity_px() const override {
        std::vector<float> result;
        for (int y = 0; y < disparity_.rows; y++) {
            const int16_t *row = disparity_.ptr<int16_t>(y) + before_;
            for (int x = 0; x < width_; x++) {
                const bool valid = row[x] >= disparity_min_ * kScale;
                result.push_back(valid ? static_cast<float>(row[x]) / kScale
                                       : std::numeric_limits<float>::quiet_NaN());
            }
        }
        return result;
    }

  private:
    bench_setting setting_;
    int disparity_min_, width_, before_;
    cv::Ptr<cv::StereoMatcher> matcher_;
    cv::Mat left_, right_, disparity_;
};

// Settings under which each does well on Middlebury's pairs: left-right check on, no uniqueness
// margin for SGBM; for StereoBM its default margin does better than none.
template <int mode>
std::unique_ptr<bench_method> make_sgbm(const bench_pair &pair, const bench_setting &setting) {
    return std::make_unique<opencv_method>(pair, setting, [](int count) {
        constexpr int block = 3;
        return cv::StereoSGBM::create(0, count, block, 8 * block * block, 32 * block * block, 1, 63,
                                      0, 0, 0, mode);
    });
}

template <int block>
std::unique_ptr<bench_method> make_bm(const bench_pair &pair, const bench_setting &setting) {
    return std::make_unique<opencv_method>(pair, setting, [](int count) {
        cv::Ptr<cv::StereoBM> matcher = cv::StereoBM::create(count, block);
        matcher->setDisp12MaxDiff(1);
        matcher->setUniquenessRatio(15);
        return matcher;
    });
}

}  // namespace

const std::vector<bench_method_entry> &bench_methods() {
    static const std::vector<bench_method_entry> methods = {
        {"vergence match", "defaults, speckles below 60 px removed", true, bench_make_match},
        {"vergence match+refine", "the same, then sub-pixel refinement and sigma", true,
         bench_make_refined},
        {bench_reference, "block 3, P1 72, P2 288, disp12MaxDiff 1, uniqueness 0", false,
         make_sgbm<cv::StereoSGBM::MODE_SGBM_3WAY>},
        {"SGBM", "the same, 5 directions", false, make_sgbm<cv::StereoSGBM::MODE_SGBM>},
        {"SGBM HH4", "the same, 4 directions, two passes", false,
         make_sgbm<cv::StereoSGBM::MODE_HH4>},
        {"SGBM HH", "the same, 8 directions, two passes", false,
         make_sgbm<cv::StereoSGBM::MODE_HH>},
        {"StereoBM 11", "block 11, disp12MaxDiff 1, uniqueness 15", false, make_bm<11>},
        {"StereoBM 15", "block 15, disp12MaxDiff 1, uniqueness 15", false, make_bm<15>},
    };
    return methods;
}
