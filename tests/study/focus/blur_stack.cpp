// SPDX-License-Identifier: Apache-2.0
#include "blur_stack.hpp"

#include <algorithm>
#include <cmath>

namespace focus {

const char *const kTextureNames[kTextureKinds] = {"power", "edges", "step", "bars", "lights"};

namespace {

constexpr std::size_t kSize = BlurStack::kSize, kPixels = kSize * kSize;
constexpr double kPi = 3.14159265358979323846;

/// Diameters of the discs. Dense near focus, as the images between two levels are blends of both.
const std::vector<double> &diameters() {
    static const std::vector<double> all = [] {
        std::vector<double> list = {0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8};
        while (list.back() < 64) {
            list.push_back(list.back() * 1.2);
        }
        while (list.back() < 2000) {
            list.push_back(list.back() * 1.3);
        }
        return list;
    }();
    return all;
}

struct Plane {
    std::vector<float> re = std::vector<float>(kPixels), im = std::vector<float>(kPixels);
};

/// Fourier transform of all columns at once. sign -1: forward; +1: backward, without scale.
void transform_columns(Plane &plane, float sign) {
    float *re = plane.re.data(), *im = plane.im.data();
    for (std::size_t i = 1, j = 0; i < kSize; i++) {
        std::size_t bit = kSize >> 1;
        for (; (j & bit) != 0; bit >>= 1) {
            j ^= bit;
        }
        j ^= bit;
        if (i < j) {
            std::swap_ranges(re + i * kSize, re + (i + 1) * kSize, re + j * kSize);
            std::swap_ranges(im + i * kSize, im + (i + 1) * kSize, im + j * kSize);
        }
    }
    for (std::size_t half = 1; half < kSize; half *= 2) {
        for (std::size_t k = 0; k < half; k++) {
            const double angle = kPi * double(k) / double(half);
            const float c = float(std::cos(angle)), s = sign * float(std::sin(angle));
            for (std::size_t row = k; row < kSize; row += 2 * half) {
                float *ar = re + row * kSize, *ai = im + row * kSize;
                float *br = ar + half * kSize, *bi = ai + half * kSize;
                for (std::size_t x = 0; x < kSize; x++) {
                    const float tr = br[x] * c - bi[x] * s, ti = br[x] * s + bi[x] * c;
                    br[x] = ar[x] - tr;
                    bi[x] = ai[x] - ti;
                    ar[x] += tr;
                    ai[x] += ti;
                }
            }
        }
    }
}

void transpose(std::vector<float> &image) {
    constexpr std::size_t kTile = 16;
    for (std::size_t y = 0; y < kSize; y += kTile) {
        for (std::size_t x = y; x < kSize; x += kTile) {
            for (std::size_t v = 0; v < kTile; v++) {
                for (std::size_t u = x == y ? v + 1 : 0; u < kTile; u++) {
                    std::swap(image[(y + v) * kSize + x + u], image[(x + u) * kSize + y + v]);
                }
            }
        }
    }
}

void transform(Plane &plane, float sign) {
    transform_columns(plane, sign);
    transpose(plane.re);
    transpose(plane.im);
    transform_columns(plane, sign);
}

/// Distance from zero of a frequency, in cycles per pixel.
double frequency(std::size_t index) {
    const double k = double(index < kSize / 2 ? index : kSize - index);
    return k / double(kSize);
}

/// Airy's function 2 J1(x) / x: the transfer function of a disc.
double airy(double x) {
    return x < 1e-6 ? 1 : 2 * ::j1(x) / x;
}

/// The transfer function by squared frequency in units of 1/kSize: all that occur, once.
class Transfer {
  public:
    Transfer(double diameter_px, double spot_px) {
        // Linear between samples of the frequency: fine enough for a disc of 100 px, and larger
        // ones pass only the lowest frequencies, which are whole samples.
        for (std::size_t i = 0; i < table_.size(); i++) {
            const double nu = double(i) / kPerCycle / double(kSize);
            const double gauss = std::exp(-2 * kPi * kPi * spot_px * spot_px * nu * nu);
            table_[i] = float(airy(kPi * diameter_px * nu) * gauss);
        }
    }
    float at(float radius) const {
        const float place = radius * float(kPerCycle);
        const std::size_t low = std::size_t(place);
        const float part = place - float(low);
        return table_[low] + part * (table_[low + 1] - table_[low]);
    }

  private:
    static constexpr std::size_t kPerCycle = 4;
    std::array<float, 184 * kPerCycle + 2> table_{};  // 128 * sqrt(2) is 181.02
};

const std::vector<float> &radii() {
    static const std::vector<float> all = [] {
        std::vector<float> list(kPixels);
        for (std::size_t y = 0; y < kSize; y++) {
            for (std::size_t x = 0; x < kSize; x++) {
                list[y * kSize + x] = float(std::hypot(frequency(x), frequency(y)) * double(kSize));
            }
        }
        return list;
    }();
    return all;
}

float &at(std::vector<float> &image, std::ptrdiff_t x, std::ptrdiff_t y) {
    constexpr std::ptrdiff_t kMask = std::ptrdiff_t(kSize) - 1;
    return image[std::size_t((y & kMask) * std::ptrdiff_t(kSize) + (x & kMask))];
}

void draw_power(std::vector<float> &image, double slope, simrig::Noise &noise) {
    Plane plane;
    for (std::size_t i = 0; i < kPixels; i++) {
        plane.re[i] = float(noise.gauss());
    }
    transform(plane, -1);
    for (std::size_t i = 0; i < kPixels; i++) {
        const float radius = radii()[i];
        const float gain = radius == 0 ? 0 : std::pow(radius, -float(slope));
        plane.re[i] *= gain;
        plane.im[i] *= gain;
    }
    transform(plane, 1);
    image = plane.re;
}

/// Overlapping polygons with straight edges in all directions.
void draw_edges(std::vector<float> &image, simrig::Noise &noise) {
    for (int i = 0; i < 40; i++) {
        const double x = noise.uniform() * kSize, y = noise.uniform() * kSize;
        const double turn = noise.uniform() * kPi, c = std::cos(turn), s = std::sin(turn);
        const double across = 4 + 36 * noise.uniform(), along = 4 + 36 * noise.uniform();
        const float value = float(noise.uniform());
        const auto reach = std::ptrdiff_t(std::hypot(across, along)) + 1;
        for (std::ptrdiff_t v = -reach; v <= reach; v++) {
            for (std::ptrdiff_t u = -reach; u <= reach; u++) {
                const double a = double(u) * c + double(v) * s, b = double(v) * c - double(u) * s;
                if (std::abs(a) < across && std::abs(b) < along) {
                    at(image, std::ptrdiff_t(x) + u, std::ptrdiff_t(y) + v) = value;
                }
            }
        }
    }
}

/// One edge, oblique, somewhere in the middle of a window; the next is half a texture away.
void draw_step(std::vector<float> &image, simrig::Noise &noise) {
    const double slant = noise.uniform() - 0.5, at_px = 44 + 40 * noise.uniform();
    const bool upright = noise.chance(0.5);
    for (std::size_t y = 0; y < kSize; y++) {
        for (std::size_t x = 0; x < kSize; x++) {
            const double along = double(upright ? y : x), across = double(upright ? x : y);
            // The slant goes there and back, so that the texture repeats itself.
            const double edge = at_px + slant * std::min(along, double(kSize) - along) * 0.5;
            image[y * kSize + x] = float(std::clamp(across - edge, 0.0, 1.0) -
                                         std::clamp(across - edge - 128, 0.0, 1.0));
        }
    }
}

void draw_bars(std::vector<float> &image, simrig::Noise &noise) {
    const bool upright = noise.chance(0.5);
    const std::size_t half = std::size_t(4) << (noise.next() % 4);
    for (std::size_t y = 0; y < kSize; y++) {
        for (std::size_t x = 0; x < kSize; x++) {
            image[y * kSize + x] = ((upright ? x : y) / half) % 2 == 0 ? 0.0F : 1.0F;
        }
    }
}

/// Small bright points before a dark ground with some texture: out of focus they are discs.
void draw_lights(std::vector<float> &image, simrig::Noise &noise) {
    draw_power(image, 1, noise);
    double sum = 0;
    for (const float value : image) {
        sum += double(value) * value;
    }
    const float scale = float(0.2 / std::sqrt(sum / double(kPixels)));
    for (float &value : image) {
        value *= scale;
    }
    const int count = 6 + int(noise.next() % 40);
    for (int i = 0; i < count; i++) {
        const auto x = std::ptrdiff_t(noise.next() % kSize),
                   y = std::ptrdiff_t(noise.next() % kSize);
        const float value = float(2 + 8 * noise.uniform());
        for (std::ptrdiff_t v = 0; v < 3; v++) {
            for (std::ptrdiff_t u = 0; u < 3; u++) {
                at(image, x + u, y + v) = value;
            }
        }
    }
}

/// Mean 1, and this rms; negative radiance is cut off.
void normalise(std::vector<float> &image, double contrast) {
    double sum = 0, squares = 0;
    for (const float value : image) {
        sum += value;
        squares += double(value) * value;
    }
    const double mean = sum / double(kPixels);
    const double rms = std::sqrt(std::max(squares / double(kPixels) - mean * mean, 1e-30));
    for (float &value : image) {
        value = std::max(0.0F, float(1 + (value - mean) * contrast / rms));
    }
}

}  // namespace

void BlurStack::build(const Texture &texture, double spot_px, simrig::Noise &noise) {
    std::vector<float> image(kPixels, 0.5F);
    switch (texture.kind) {
        case TextureKind::kPower:
            draw_power(image, texture.slope, noise);
            break;
        case TextureKind::kEdges:
            draw_edges(image, noise);
            break;
        case TextureKind::kStep:
            draw_step(image, noise);
            break;
        case TextureKind::kBars:
            draw_bars(image, noise);
            break;
        case TextureKind::kLights:
            draw_lights(image, noise);
            break;
    }
    normalise(image, texture.contrast);
    Plane sharp;
    sharp.re = image;
    transform(sharp, -1);
    spot_px_ = spot_px;
    const std::vector<double> &sizes = diameters();
    levels_.resize(sizes.size());
    Plane plane;
    // Two levels at a time: as real and imaginary part.
    for (std::size_t i = 0; i < sizes.size(); i += 2) {
        const bool pair = i + 1 < sizes.size();
        const Transfer one(sizes[i], spot_px), other(sizes[pair ? i + 1 : i], spot_px);
        for (std::size_t k = 0; k < kPixels; k++) {
            const float a = one.at(radii()[k]) / float(kPixels);
            const float b = other.at(radii()[k]) / float(kPixels);
            plane.re[k] = sharp.re[k] * a - sharp.im[k] * b;
            plane.im[k] = sharp.im[k] * a + sharp.re[k] * b;
        }
        transform(plane, 1);
        levels_[i] = plane.re;
        if (pair) {
            levels_[i + 1] = plane.im;
        }
    }
}

void BlurStack::add(BlurMix &mix, double diameter_px, double part) const {
    const std::vector<double> &sizes = diameters();
    const auto above = std::upper_bound(sizes.begin() + 1, sizes.end() - 1, diameter_px);
    const std::size_t high = std::size_t(above - sizes.begin());
    const double low_px = sizes[high - 1], high_px = sizes[high];
    // Contrast is lost with the square of a small diameter.
    const double square = diameter_px * diameter_px - low_px * low_px;
    const double share = std::min(1.0, square / (high_px * high_px - low_px * low_px));
    if (mix.parts.empty()) {
        mix.first = high - 1;
    } else if (high - 1 < mix.first) {
        mix.parts.insert(mix.parts.begin(), mix.first - (high - 1), 0.0F);
        mix.first = high - 1;
    }
    if (mix.parts.size() < high + 1 - mix.first) {
        mix.parts.resize(high + 1 - mix.first);
    }
    mix.parts[high - 1 - mix.first] += float(part * (1 - share));
    mix.parts[high - mix.first] += float(part * share);
}

}  // namespace focus
