// SPDX-License-Identifier: Apache-2.0
// Corners of boards: ours and OpenCV's sector-based finder with ACCURACY, on the same rendered
// images in the same run. Usage: detect_bench [IMAGES [SEED]].
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <opencv2/calib3d.hpp>

#include "calib/detect/detect.hpp"
#include "synthetic/board_cases.hpp"

using namespace synthetic;

namespace {

struct Case {
    const char *name;
    double width_share, blur_px, noise_grey;
    bool opencv;  // OpenCV's does not terminate on very blurred boards
};

const Case cases[] = {
    {"fills 75 %, blur 0.7, noise 2", 0.75, 0.7, 2, true},
    {"fills 75 %, blur 2, noise 4", 0.75, 2, 4, true},
    {"fills 75 %, blur 5, noise 4", 0.75, 5, 4, false},
    {"fills 12 %, blur 0.7, noise 2", 0.12, 0.7, 2, true},
    {"fills 12 %, blur 2, noise 4", 0.12, 2, 4, true},
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Tally {
    Errors errors;
    double seconds = 0;
    int found = 0;
};

// OpenCV's may number the board from the other end; its corners have no standard deviation.
calib::board_view opencv_view(const calib::board &board, BoardImage *image) {
    const cv::Mat pixels(image->height, image->width, CV_8U, image->pixels.data());
    std::vector<cv::Point2f> points;
    calib::board_view view;
    if (!cv::findChessboardCornersSB(pixels, cv::Size(board.columns, board.rows), points,
                                     cv::CALIB_CB_ACCURACY)) {
        return view;
    }
    const Pixel &first = image->corners.front();
    const auto distance = [&](const cv::Point2f &p) {
        return std::hypot(static_cast<double>(p.x) - first.x, static_cast<double>(p.y) - first.y);
    };
    if (distance(points.back()) < distance(points.front())) {
        std::reverse(points.begin(), points.end());
    }
    for (size_t i = 0; i < points.size(); i++) {
        view.corners.push_back({static_cast<int>(i), static_cast<double>(points[i].x),
                                static_cast<double>(points[i].y), 1});
    }
    return view;
}

template <class Detect>
void tally(BoardImage *image, Detect detect, Tally *sums) {
    const auto start = std::chrono::steady_clock::now();
    const calib::board_view view = detect();
    sums->seconds += seconds_since(start);
    sums->found += view.corners.empty() ? 0 : 1;
    sums->errors.add(*image, view);
}

void run(const Case &c, int images, uint64_t seed) {
    const calib::board board = plain_board(9, 6);
    Random random(seed);
    Tally ours, theirs;
    for (int i = 0; i < images; i++) {
        const Camera camera = lens_of(2048, 1536, random);
        BoardLight light;
        light.blur_px = c.blur_px;
        light.noise_grey = c.noise_grey;
        const BoardPose pose =
            hold_board(board, camera, random_hold(c.width_share, 0.4, 0.4, random));
        light.seed = random.bits();
        BoardImage image = photograph(board, camera, pose, light);
        tally(
            &image, [&] { return calib::detect_board(board, image.view(), {}); }, &ours);
        if (c.opencv) {
            tally(
                &image, [&] { return opencv_view(board, &image); }, &theirs);
        }
    }
    std::printf("%-30s  %d/%d  %.4f  %.3f  %.2f  %.3f", c.name, ours.found, images,
                ours.errors.rms_px(), ours.errors.worst_px(), ours.errors.z_rms(),
                ours.seconds / images);
    if (c.opencv) {
        std::printf("  |  %d/%d  %.4f  %.3f  |  %.0f\n", theirs.found, images,
                    theirs.errors.rms_px(), theirs.seconds / images, theirs.seconds / ours.seconds);
    } else {
        std::printf("  |  not run\n");
    }
    std::fflush(stdout);
}

}  // namespace

int main(int argc, char **argv) {
    const int images = argc > 1 ? std::max(1, std::atoi(argv[1])) : 3;
    const uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 0) : test_seed();
    std::printf(
        "9 x 6 corners, 2048 x 1536 pixels, %d images each, seed %llu, one thread for ours\n"
        "case                            found  rms px  worst  z     s      |  OpenCV's "
        "found, rms px, s  |  times faster\n",
        images, static_cast<unsigned long long>(seed));
    for (const Case &c : cases) {
        run(c, images, seed);
    }
    return 0;
}
