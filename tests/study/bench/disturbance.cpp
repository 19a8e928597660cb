// SPDX-License-Identifier: Apache-2.0
#include "bench/disturbance.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace {

constexpr uint64_t kSeed = 20090915;
constexpr double kFullWell_electrons = 40000, kReadNoise_electrons = 8, kExposure = 0.01;

// Each pixel independently, rounded and clipped like an 8-bit sensor.
void map_greys(cv::Mat &image, const std::function<double(double grey)> &curve) {
    cv::Mat table(1, 256, CV_8U);
    for (int i = 0; i < 256; i++) {
        table.at<uint8_t>(i) = cv::saturate_cast<uint8_t>(curve(i));
    }
    cv::LUT(image, table, image);
}

void gain(cv::Mat &image, double factor) {
    map_greys(image, [factor](double grey) { return factor * grey; });
}

void offset(cv::Mat &image, double greys) {
    map_greys(image, [greys](double grey) { return grey + greys; });
}

void gamma(cv::Mat &image, double exponent) {
    map_greys(image, [exponent](double grey) { return 255 * std::pow(grey / 255, exponent); });
}

// cos^4 of the angle to the axis, which loses this share in the corners.
void vignette(cv::Mat &image, double corner_loss) {
    const double corner_tan2 = 1 / std::sqrt(1 - corner_loss) - 1;
    const double centre_x = (image.cols - 1) / 2.0;
    const double centre_y = (image.rows - 1) / 2.0;
    const double corner2 = centre_x * centre_x + centre_y * centre_y;
    for (int y = 0; y < image.rows; y++) {
        for (int x = 0; x < image.cols; x++) {
            const double dx = x - centre_x;
            const double dy = y - centre_y;
            const double secant2 = 1 + corner_tan2 * (dx * dx + dy * dy) / corner2;
            for (int c = 0; c < image.channels(); c++) {
                uint8_t &level = image.ptr<uint8_t>(y, x)[c];
                level = cv::saturate_cast<uint8_t>(level / (secant2 * secant2));
            }
        }
    }
}

// Shot and read noise of a sensor that received a hundredth of the light and was amplified back.
void low_light(cv::Mat &image, uint64_t seed) {
    const double electrons_per_grey = kFullWell_electrons * kExposure / 255;
    cv::RNG random(seed);
    for (int y = 0; y < image.rows; y++) {
        for (int i = 0; i < image.cols * image.channels(); i++) {
            uint8_t &level = image.ptr<uint8_t>(y)[i];
            const double electrons = level * electrons_per_grey;
            const double sigma = std::sqrt(electrons + kReadNoise_electrons * kReadNoise_electrons);
            level = cv::saturate_cast<uint8_t>((electrons + random.gaussian(sigma)) /
                                               electrons_per_grey);
        }
    }
}

void add_noise(cv::Mat &image, double sigma_greys, uint64_t seed) {
    cv::RNG random(seed);
    for (int y = 0; y < image.rows; y++) {
        for (int i = 0; i < image.cols * image.channels(); i++) {
            uint8_t &level = image.ptr<uint8_t>(y)[i];
            level = cv::saturate_cast<uint8_t>(level + random.gaussian(sigma_greys));
        }
    }
}

// Surfaces of hardly any texture: a tenth of it is left, and their edges, and there is some noise.
void make_faint(cv::Mat &image, uint64_t seed) {
    constexpr double share = 0.1, sigma_greys = 0.8, range_greys = 30, range_px = 6;
    constexpr int diameter_px = 15, passes = 3;
    cv::Mat plain = image;
    for (int i = 0; i < passes; i++) {
        cv::Mat smoothed;
        cv::bilateralFilter(plain, smoothed, diameter_px, range_greys, range_px);
        plain = smoothed;
    }
    cv::addWeighted(image, share, plain, 1 - share, 0, image);
    add_noise(image, sigma_greys, seed);
}

// The gain at which this share of the pixels is white.
double saturating_gain(const cv::Mat &image, double share) {
    std::vector<uint8_t> greys(image.begin<uint8_t>(), image.end<uint8_t>());
    const auto at = static_cast<std::ptrdiff_t>((1 - share) * static_cast<double>(greys.size()));
    std::nth_element(greys.begin(), greys.begin() + at, greys.end());
    return 255.0 / std::max<int>(greys[static_cast<std::size_t>(at)], 1);
}

void shift_down(cv::Mat &image, double rows) {
    const cv::Matx23d move(1, 0, 0, 0, 1, rows);
    cv::Mat moved;
    cv::warpAffine(image, moved, move, image.size(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
    image = moved;
}

// In grey and in colour alike.
using image_change = std::function<void(cv::Mat &image)>;

void change_both(cv::Mat &grey, cv::Mat &colour, const image_change &change) {
    change(grey);
    if (!colour.empty()) {
        change(colour);
    }
}

// Both images of cameras in colour, each with its own seed; their grey is made of the colours.
std::function<void(bench_pair &pair)> cameras_by(void (*change)(cv::Mat &image, uint64_t seed)) {
    const auto one = [change](cv::Mat &grey, cv::Mat &colour, uint64_t seed) {
        change(colour.empty() ? grey : colour, seed);
        if (!colour.empty()) {
            cv::cvtColor(colour, grey, cv::COLOR_RGB2GRAY);
        }
    };
    return [one](bench_pair &pair) {
        one(pair.left, pair.left_colour, kSeed + 1);
        one(pair.right, pair.right_colour, kSeed);
    };
}

std::function<void(bench_pair &pair)> right_by(const image_change &change) {
    return [change](bench_pair &pair) { change_both(pair.right, pair.right_colour, change); };
}

// Whose images in grey were changed.
void drop_colour(bench_pair &pair) {
    cv::Mat left, right;
    cv::cvtColor(pair.left, left, cv::COLOR_GRAY2RGB);
    cv::cvtColor(pair.right, right, cv::COLOR_GRAY2RGB);
    pair.left_colour = left;
    pair.right_colour = right;
}

bench_pair with_images(const bench_pair &pair, const cv::Mat &left, const cv::Mat &right) {
    bench_pair result = pair;
    result.left = left.clone();
    result.right = right.clone();
    drop_colour(result);
    result.truth_px.clear();
    result.mask.clear();
    return result;
}

bench_pair no_texture(const bench_pair &pair, const bench_pair &) {
    const cv::Mat grey(pair.left.size(), CV_8U, cv::Scalar(128));
    bench_pair result = with_images(pair, grey, grey);
    add_noise(result.left, 2, kSeed);
    add_noise(result.right, 2, kSeed + 1);
    drop_colour(result);
    return result;
}

bench_pair stripes(const bench_pair &pair, const bench_pair &) {
    constexpr double period_px = 12;
    cv::Mat image(pair.left.size(), CV_8U);
    for (int x = 0; x < image.cols; x++) {
        const double phase = 2 * CV_PI * x / period_px;
        image.col(x).setTo(cv::Scalar(std::round(128 + 80 * std::sin(phase))));
    }
    bench_pair result = with_images(pair, image, image);
    add_noise(result.left, 1, kSeed);
    add_noise(result.right, 1, kSeed + 1);
    drop_colour(result);
    return result;
}

bench_pair one_black(const bench_pair &pair, const bench_pair &) {
    return with_images(pair, pair.left, cv::Mat::zeros(pair.left.size(), CV_8U));
}

bench_pair swapped(const bench_pair &pair, const bench_pair &) {
    bench_pair result = with_images(pair, pair.right, pair.left);
    result.left_colour = pair.right_colour.clone();
    result.right_colour = pair.left_colour.clone();
    return result;
}

// Paired with itself, rotated by half a turn, if there is no other.
bench_pair unrelated(const bench_pair &pair, const bench_pair &other) {
    bench_pair result = with_images(pair, pair.left, other.right);
    result.left_colour = pair.left_colour.clone();
    result.right_colour = other.right_colour.clone();
    change_both(result.right, result.right_colour, [&](cv::Mat &image) {
        cv::resize(image, image, pair.left.size(), 0, 0, cv::INTER_AREA);
        if (other.name == pair.name) {
            cv::rotate(image, image, cv::ROTATE_180);
        }
    });
    return result;
}

}  // namespace

const std::vector<disturbance> &photometric_disturbances() {
    static const std::vector<disturbance> all = {
        {"clean", "no change", [](bench_pair &) {}},
        {"gain.7", "right image times 0.7", right_by([](cv::Mat &image) { gain(image, 0.7); })},
        {"gain1.3", "right image times 1.3, cut off",
         right_by([](cv::Mat &image) { gain(image, 1.3); })},
        {"off-20", "right image less 20 grey levels",
         right_by([](cv::Mat &image) { offset(image, -20); })},
        {"off+20", "right image plus 20 grey levels",
         right_by([](cv::Mat &image) { offset(image, 20); })},
        {"gamma.7", "right image to the power of 0.7",
         right_by([](cv::Mat &image) { gamma(image, 0.7); })},
        {"gamma1.4", "right image to the power of 1.4",
         right_by([](cv::Mat &image) { gamma(image, 1.4); })},
        {"vignette", "right image by cos^4, 40 % less in the corners",
         right_by([](cv::Mat &image) { vignette(image, 0.4); })},
        {disturbance_noise, "grey, right image with shot and read noise of 1 % of the exposure",
         [](bench_pair &p) {
             low_light(p.right, kSeed);
             drop_colour(p);
         }},
        {"noise2", "grey, both images with that noise",
         [](bench_pair &p) {
             low_light(p.left, kSeed + 1);
             low_light(p.right, kSeed);
             drop_colour(p);
         }},
        {"noise rgb", "in colour, both images with that noise in each channel",
         cameras_by(low_light)},
        {"faint", "in colour, a tenth of the texture, noise of 0.8 grey levels in each channel",
         cameras_by(make_faint)},
        {"clipped", "right image amplified until a fifth of it is white",
         [](bench_pair &p) {
             const double factor = saturating_gain(p.right, 0.2);
             right_by([factor](cv::Mat &image) { gain(image, factor); })(p);
         }},
        {"half row", "right image half a pixel lower",
         right_by([](cv::Mat &image) { shift_down(image, 0.5); })},
        {disturbance_exposure, "right image exposed 0.6 times as long",
         right_by([](cv::Mat &image) { gain(image, 0.6); })},
    };
    return all;
}

const std::vector<disturbance_nothing> &no_surface_disturbances() {
    static const std::vector<disturbance_nothing> all = {
        {"no texture", "both images grey, noise of 2 grey levels", no_texture},
        {"stripes", "both images the same stripes of 12 px, noise of 1 grey level", stripes},
        {"one black", "the right image black", one_black},
        {"swapped", "left and right swapped", swapped},
        {"unrelated", "the right image of the next pair", unrelated},
    };
    return all;
}

bench_pair disturbance_copy(const bench_pair &pair) {
    bench_pair copy = pair;
    copy.left = pair.left.clone();
    copy.right = pair.right.clone();
    copy.left_colour = pair.left_colour.clone();
    copy.right_colour = pair.right_colour.clone();
    return copy;
}
