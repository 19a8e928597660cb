// SPDX-License-Identifier: Apache-2.0
#include "synthetic/pair.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace synthetic {

namespace {

uint16_t expose(double reflectance, const Sensor &sensor, Random &random) {
    const double full_scale = static_cast<double>((1 << sensor.bits) - 1);
    double signal =
        sensor.gain * std::pow(std::max(reflectance, 0.0), sensor.gamma) + sensor.offset;
    if (sensor.full_well_electrons > 0) {
        // The normal limit of Poisson noise; accurate from about ten electrons.
        signal += random.normal() * std::sqrt(std::max(signal, 0.0) / sensor.full_well_electrons);
    }
    if (sensor.noise_grey > 0) {
        signal += random.normal() * sensor.noise_grey / 255;
    }
    return static_cast<uint16_t>(std::lround(std::clamp(signal, 0.0, 1.0) * full_scale));
}

bool inside(const Camera &camera, const Pixel &pixel) {
    return pixel.x >= 0 && pixel.x <= camera.width - 1 && pixel.y >= 0 &&
           pixel.y <= camera.height - 1;
}

Visibility visibility_of(const Scene &scene, const Camera &other, const Vector &point,
                         const std::optional<Pixel> &there) {
    if (!there || !inside(other, *there)) {
        return Visibility::Outside;
    }
    const std::optional<Hit> first = scene.cast(other.centre_mm, point - other.centre_mm);
    return first && first->t < 1 - 1e-6 ? Visibility::Occluded : Visibility::Visible;
}

ViewTruth mirrored_truth(const ViewTruth &truth, int width, int height) {
    ViewTruth result = truth;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const size_t from = static_cast<size_t>(y) * static_cast<size_t>(width) +
                                static_cast<size_t>(width - 1 - x);
            const size_t to =
                static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
            result.disparity_px[to] = truth.disparity_px[from];
            result.vertical_px[to] = -truth.vertical_px[from];
            result.visibility[to] = truth.visibility[from];
            result.surface[to] = truth.surface[from];
        }
    }
    return result;
}

std::vector<uint16_t> mirrored_image(const std::vector<uint16_t> &image, int width) {
    std::vector<uint16_t> result = image;
    for (auto row = result.begin(); row != result.end(); row += width) {
        std::reverse(row, row + width);
    }
    return result;
}

}  // namespace

std::vector<uint16_t> render_view(const Scene &scene, const Camera &camera, const Sensor &sensor,
                                  int samples, uint64_t seed) {
    std::vector<uint16_t> image;
    image.reserve(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height));
    Random random(seed);
    for (int y = 0; y < camera.height; y++) {
        for (int x = 0; x < camera.width; x++) {
            double sum = 0;
            for (int j = 0; j < samples; j++) {
                for (int i = 0; i < samples; i++) {
                    const Pixel at{x + (i + 0.5) / samples - 0.5, y + (j + 0.5) / samples - 0.5};
                    const auto hit = scene.cast(camera.centre_mm, camera.direction(at));
                    sum += hit ? scene.reflectance(*hit) : 0;
                }
            }
            image.push_back(expose(sum / (samples * samples), sensor, random));
        }
    }
    return image;
}

ViewTruth truth_of(const Scene &scene, const Camera &camera, const Camera &other, bool is_left) {
    const size_t count = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    ViewTruth truth;
    truth.disparity_px.assign(count, unknown);
    truth.vertical_px.assign(count, unknown);
    truth.visibility.assign(count, Visibility::Nothing);
    truth.surface.assign(count, -1);
    size_t i = 0;
    for (int y = 0; y < camera.height; y++) {
        for (int x = 0; x < camera.width; x++, i++) {
            const Pixel here{static_cast<double>(x), static_cast<double>(y)};
            const auto hit = scene.cast(camera.centre_mm, camera.direction(here));
            if (!hit) {
                continue;
            }
            const std::optional<Pixel> there = other.project(hit->point);
            truth.surface[i] = hit->surface;
            truth.visibility[i] = visibility_of(scene, other, hit->point, there);
            if (there) {
                const double sign = is_left ? 1 : -1;
                truth.disparity_px[i] = sign * (here.x - there->x);
                truth.vertical_px[i] = sign * (there->y - here.y);
            }
        }
    }
    return truth;
}

Pair render(const Scene &scene, const Rig &rig, const RenderOptions &options) {
    Pair pair;
    pair.rig = rig;
    pair.width = rig.left.width;
    pair.height = rig.left.height;
    pair.bits = options.left.bits;
    pair.left = render_view(scene, rig.left, options.left, options.samples, options.seed);
    pair.right = render_view(scene, rig.right, options.right, options.samples,
                             options.seed ^ 0x5bd1e995cafef00du);
    pair.left_truth = truth_of(scene, rig.left, rig.right, true);
    pair.right_truth = truth_of(scene, rig.right, rig.left, false);
    return pair;
}

std::vector<bool> inner_pixels(const Pair &pair, const ViewTruth &truth, int radius) {
    std::vector<bool> inner(truth.surface.size(), true);
    for (int y = 0; y < pair.height; y++) {
        for (int x = 0; x < pair.width; x++) {
            const int surface = truth.surface[pair.index(x, y)];
            const int y_end = std::min(y + radius, pair.height - 1);
            const int x_end = std::min(x + radius, pair.width - 1);
            bool alike = surface >= 0;
            for (int v = std::max(y - radius, 0); alike && v <= y_end; v++) {
                for (int u = std::max(x - radius, 0); alike && u <= x_end; u++) {
                    alike = truth.surface[pair.index(u, v)] == surface;
                }
            }
            inner[pair.index(x, y)] = alike;
        }
    }
    return inner;
}

std::vector<uint8_t> as_u8(const std::vector<uint16_t> &image, int width, int height, int bits,
                           int stride) {
    std::vector<uint8_t> result(static_cast<size_t>(stride) * static_cast<size_t>(height));
    for (size_t i = 0; i < result.size(); i++) {
        result[i] = static_cast<uint8_t>(i * 151 + 77);
    }
    const int full_scale = (1 << bits) - 1;
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const size_t from =
                static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
            const size_t to =
                static_cast<size_t>(y) * static_cast<size_t>(stride) + static_cast<size_t>(x);
            result[to] = static_cast<uint8_t>((image[from] * 255 + full_scale / 2) / full_scale);
        }
    }
    return result;
}

Pair mirrored(const Pair &pair) {
    Pair result = pair;
    result.left = mirrored_image(pair.right, pair.width);
    result.right = mirrored_image(pair.left, pair.width);
    result.left_truth = mirrored_truth(pair.right_truth, pair.width, pair.height);
    result.right_truth = mirrored_truth(pair.left_truth, pair.width, pair.height);
    return result;
}

}  // namespace synthetic
