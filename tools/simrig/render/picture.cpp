// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/picture.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

namespace world {
namespace {

struct Close {
    void operator()(std::FILE *file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

File opened(const std::string &path) {
    File file(std::fopen(path.c_str(), "wb"));
    if (file == nullptr) {
        throw std::runtime_error(path + ": cannot be written");
    }
    return file;
}

void finished(const std::string &path, File file) {
    const bool wrong = std::ferror(file.get()) != 0;
    if (std::fclose(file.release()) != 0 || wrong) {
        throw std::runtime_error(path + ": cannot be written completely");
    }
}

// The mosaic as light, 0 at black; mirrored at the edges by two, so that colours stay in place.
class Mosaic {
  public:
    Mosaic(const Frame &frame, const Sensor &sensor)
        : frame_(frame), black_(sensor.black_level_dn) {
        const double scale = 1 / (1023 - black_);
        for (int c = 0; c < 3; c++) {
            gain_[c] = scale / sensor.filter_part[static_cast<std::size_t>(c)];
        }
    }
    double at(int x, int y) const {
        x = mirrored(x, frame_.columns);
        y = mirrored(y, frame_.rows);
        const double dn = frame_.pixels[static_cast<std::size_t>(y * frame_.columns + x)];
        return (dn - black_) * gain_[channel(x, y)];
    }
    // Where green saturates: brighter red or blue next to it would only tint white.
    double white() const { return gain_[1] * (1023 - black_); }
    static int channel(int x, int y) {
        if ((x + y) % 2 == 0) {
            return 1;
        }
        return y % 2 == 0 ? 0 : 2;
    }

  private:
    static int mirrored(int place, int count) {
        if (place < 0) {
            return -place;
        }
        return place >= count ? 2 * count - 2 - place : place;
    }

    const Frame &frame_;
    double black_;
    double gain_[3];
};

void demosaic(const Mosaic &m, int x, int y, double (&rgb)[3]) {
    const double here = m.at(x, y);
    const double across = m.at(x - 1, y) + m.at(x + 1, y);
    const double along = m.at(x, y - 1) + m.at(x, y + 1);
    const double far_across = m.at(x - 2, y) + m.at(x + 2, y);
    const double far_along = m.at(x, y - 2) + m.at(x, y + 2);
    const double corners =
        m.at(x - 1, y - 1) + m.at(x + 1, y - 1) + m.at(x - 1, y + 1) + m.at(x + 1, y + 1);
    const int own = Mosaic::channel(x, y);
    rgb[own] = here;
    if (own == 1) {
        const double rows = (4 * across + 5 * here - far_across - corners + 0.5 * far_along) / 8;
        const double columns = (4 * along + 5 * here - far_along - corners + 0.5 * far_across) / 8;
        const bool red_row = y % 2 == 0;
        rgb[0] = red_row ? rows : columns;
        rgb[2] = red_row ? columns : rows;
        return;
    }
    rgb[1] = (2 * (across + along) + 4 * here - far_across - far_along) / 8;
    rgb[2 - own] = (2 * corners + 6 * here - 1.5 * (far_across + far_along)) / 8;
}

// sRGB, with highlights bent towards white instead of cut.
std::uint8_t toned(double light) {
    const double x = std::max(light, 0.0);
    constexpr double kKnee = 0.7;
    const double bent =
        x < kKnee ? x : kKnee + (1 - kKnee) * (1 - std::exp(-(x - kKnee) / (1 - kKnee)));
    const double srgb = bent <= 0.0031308 ? 12.92 * bent : 1.055 * std::pow(bent, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb, 0.0, 1.0)));
}

// PFM has its last row first.
void write_pfm(const std::string &path, const char *kind, const Truth &truth,
               const std::vector<float> &values, int channels) {
    File file = opened(path);
    std::fprintf(file.get(), "%s\n%d %d\n-1\n", kind, truth.columns, truth.rows);
    const auto row = static_cast<std::size_t>(truth.columns * channels);
    for (int y = truth.rows - 1; y >= 0; y--) {
        std::fwrite(&values[static_cast<std::size_t>(y) * row], sizeof(float), row, file.get());
    }
    finished(path, std::move(file));
}

}  // namespace

Picture developed(const Frame &frame, const Sensor &sensor, double exposure) {
    Picture picture;
    picture.columns = frame.columns;
    picture.rows = frame.rows;
    picture.rgb.resize(3 * frame.pixels.size());
    const Mosaic mosaic(frame, sensor);
    // A table of the curve: pow for every pixel is slow.
    constexpr int kSteps = 8192;
    constexpr double kMax = 4;
    std::vector<std::uint8_t> curve(kSteps + 1);
    for (int i = 0; i <= kSteps; i++) {
        curve[static_cast<std::size_t>(i)] = toned(kMax * i / kSteps);
    }
    for (int y = 0; y < frame.rows; y++) {
        for (int x = 0; x < frame.columns; x++) {
            double rgb[3];
            demosaic(mosaic, x, y, rgb);
            for (int c = 0; c < 3; c++) {
                const double light = std::min(rgb[c], mosaic.white()) * exposure;
                const double place = std::clamp(light / kMax, 0.0, 1.0) * kSteps;
                picture.rgb[static_cast<std::size_t>(3 * (y * frame.columns + x) + c)] =
                    curve[static_cast<std::size_t>(place)];
            }
        }
    }
    return picture;
}

void write_png(const std::string &path, const Picture &picture) {
    File file = opened(path);
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(picture.columns);
    image.height = static_cast<png_uint_32>(picture.rows);
    image.format = PNG_FORMAT_RGB;
    if (png_image_write_to_stdio(&image, file.get(), 0, picture.rgb.data(), 0, nullptr) == 0) {
        throw std::runtime_error(path + ": " + image.message);
    }
    finished(path, std::move(file));
}

void write_raw_pgm(const std::string &path, const Frame &frame) {
    File file = opened(path);
    std::fprintf(file.get(), "P5\n%d %d\n1023\n", frame.columns, frame.rows);
    std::vector<std::uint8_t> bytes;
    bytes.reserve(2 * frame.pixels.size());
    for (const std::uint16_t pixel : frame.pixels) {
        bytes.push_back(static_cast<std::uint8_t>(pixel >> 8));
        bytes.push_back(static_cast<std::uint8_t>(pixel & 0xFF));
    }
    std::fwrite(bytes.data(), 1, bytes.size(), file.get());
    finished(path, std::move(file));
}

void write_depth_pfm(const std::string &path, const Truth &truth) {
    write_pfm(path, "Pf", truth, truth.depth_mm, 1);
}

void write_normal_pfm(const std::string &path, const Truth &truth) {
    write_pfm(path, "PF", truth, truth.normal, 3);
}

void write_object_pgm(const std::string &path, const Truth &truth) {
    File file = opened(path);
    std::fprintf(file.get(), "P5\n%d %d\n255\n", truth.columns, truth.rows);
    std::fwrite(truth.id.data(), 1, truth.id.size(), file.get());
    finished(path, std::move(file));
}

void write_camera_yaml(const std::string &path, const Truth &truth) {
    File file = opened(path);
    std::fputs(camera_text(truth).c_str(), file.get());
    finished(path, std::move(file));
}

}  // namespace world
