// SPDX-License-Identifier: Apache-2.0
#include "stereo/image/debayer.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "synthetic/seed.hpp"

namespace {

enum Colour { RED, GREEN, BLUE };

Colour colour_at(int x, int y) {
    return (x + y) % 2 == 0 ? GREEN : y % 2 == 0 ? RED : BLUE;
}

struct Mosaic {
    int width, height, bits;
    std::vector<uint16_t> raw;

    Mosaic(int w, int h, int b) : width(w), height(h), bits(b), raw(static_cast<size_t>(w * h)) {}

    uint16_t &at(int x, int y) { return raw[static_cast<size_t>(y * width + x)]; }

    std::vector<uint16_t> developed() {
        const image_u16 view = {raw.data(), width, height, width};
        std::vector<uint16_t> rgb(3 * raw.size());
        std::vector<int32_t> work(3 * static_cast<size_t>(width + DEBAYER_MARGIN_PX));
        for (int y = 0; y < height; y++) {
            debayer_row(&view, bits, y, &rgb[static_cast<size_t>(3 * y * width)], work.data());
        }
        return rgb;
    }
};

// A plain implementation of the method: one pixel at a time, every neighbour looked up.
class Slow {
  public:
    explicit Slow(Mosaic &mosaic) : mosaic_(mosaic) {}

    int green(int x, int y) const {
        if (colour_at(wrap(x, mosaic_.width), wrap(y, mosaic_.height)) == GREEN) {
            return raw(x, y);
        }
        const int bend_x = 2 * raw(x, y) - raw(x - 2, y) - raw(x + 2, y);
        const int bend_y = 2 * raw(x, y) - raw(x, y - 2) - raw(x, y + 2);
        const int change_x = std::abs(raw(x - 1, y) - raw(x + 1, y)) + std::abs(bend_x);
        const int change_y = std::abs(raw(x, y - 1) - raw(x, y + 1)) + std::abs(bend_y);
        const double by_x = (raw(x - 1, y) + raw(x + 1, y)) / 2.0 + bend_x / 4.0;
        const double by_y = (raw(x, y - 1) + raw(x, y + 1)) / 2.0 + bend_y / 4.0;
        return rounded(change_x < change_y ? by_x : change_x > change_y ? by_y : (by_x + by_y) / 2);
    }

    int value(int x, int y, Colour wanted) const {
        const Colour own = colour_at(x, y);
        if (wanted == GREEN) {
            return clamp(green(x, y));
        }
        if (wanted == own) {
            return clamp(raw(x, y));
        }
        if (own == GREEN) {
            const bool beside = (wanted == RED) == (y % 2 == 0);
            const int dx = beside ? 1 : 0, dy = beside ? 0 : 1;
            return clamp(green(x, y) +
                         rounded((difference(x - dx, y - dy) + difference(x + dx, y + dy)) / 2.0));
        }
        const int fall = diagonal_change(x, y, 1), rise = diagonal_change(x, y, -1);
        const double by_fall = diagonal(x, y, 1), by_rise = diagonal(x, y, -1);
        return clamp(rounded(fall < rise   ? by_fall
                             : fall > rise ? by_rise
                                           : (by_fall + by_rise) / 2));
    }

  private:
    static int wrap(int i, int size) {
        while (i < 0 || i >= size) {
            i = i < 0 ? -i : 2 * (size - 1) - i;
        }
        return i;
    }
    static int rounded(double v) { return static_cast<int>(std::floor(v + 0.5)); }
    int clamp(int v) const { return std::max(0, std::min((1 << mosaic_.bits) - 1, v)); }
    int raw(int x, int y) const {
        return mosaic_.at(wrap(x, mosaic_.width), wrap(y, mosaic_.height));
    }
    int difference(int x, int y) const { return raw(x, y) - green(x, y); }
    int bend(int x, int y, int dy) const {
        return 2 * green(x, y) - green(x - 1, y - dy) - green(x + 1, y + dy);
    }
    int diagonal_change(int x, int y, int dy) const {
        return std::abs(raw(x - 1, y - dy) - raw(x + 1, y + dy)) + std::abs(bend(x, y, dy));
    }
    double diagonal(int x, int y, int dy) const {
        return (raw(x - 1, y - dy) + raw(x + 1, y + dy) + bend(x, y, dy)) / 2.0;
    }

    Mosaic &mosaic_;
};

}  // namespace

TEST_CASE("every row equals the plain form, whatever the size and depth") {
    std::mt19937_64 random(synthetic::test_seed());
    for (int i = 0; i < 120; i++) {
        const int width = i < 36 ? 2 + i % 6 : 2 + static_cast<int>(random() % 40);
        const int height = i < 36 ? 2 + i / 6 : 2 + static_cast<int>(random() % 20);
        Mosaic mosaic(width, height, 8 + i % 9);
        for (uint16_t &pixel : mosaic.raw) {
            pixel = static_cast<uint16_t>((random() & 0xffffu) >> (16 - mosaic.bits));
        }
        const Slow slow(mosaic);
        const std::vector<uint16_t> rgb = mosaic.developed();
        CAPTURE(width);
        CAPTURE(height);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                for (Colour c : {RED, GREEN, BLUE}) {
                    REQUIRE(rgb[static_cast<size_t>(3 * (y * width + x) + c)] ==
                            slow.value(x, y, c));
                }
            }
        }
    }
}

TEST_CASE("a grey wedge comes back exactly away from its borders") {
    Mosaic mosaic(40, 30, 12);
    for (int y = 0; y < 30; y++) {
        for (int x = 0; x < 40; x++) {
            mosaic.at(x, y) = static_cast<uint16_t>(100 + 20 * x + 30 * y);
        }
    }
    const std::vector<uint16_t> rgb = mosaic.developed();
    for (int y = 4; y < 26; y++) {
        for (int x = 4; x < 36; x++) {
            for (int c = 0; c < 3; c++) {
                REQUIRE(rgb[static_cast<size_t>(3 * (y * 40 + x) + c)] == 100 + 20 * x + 30 * y);
            }
        }
    }
}

TEST_CASE("a coloured surface keeps its colour up to the border") {
    Mosaic mosaic(11, 7, 10);
    const uint16_t colour[3] = {900, 300, 50};
    for (int y = 0; y < 7; y++) {
        for (int x = 0; x < 11; x++) {
            mosaic.at(x, y) = colour[colour_at(x, y)];
        }
    }
    const std::vector<uint16_t> rgb = mosaic.developed();
    for (size_t i = 0; i < rgb.size(); i++) {
        REQUIRE(rgb[i] == colour[i % 3]);
    }
}

TEST_CASE("an edge along the rows or columns stays sharp") {
    for (bool upright : {false, true}) {
        Mosaic mosaic(24, 24, 8);
        for (int y = 0; y < 24; y++) {
            for (int x = 0; x < 24; x++) {
                mosaic.at(x, y) = (upright ? x : y) < 12 ? 40 : 200;
            }
        }
        const std::vector<uint16_t> rgb = mosaic.developed();
        for (int y = 4; y < 20; y++) {
            for (int x = 4; x < 20; x++) {
                const int green = rgb[static_cast<size_t>(3 * (y * 24 + x) + 1)];
                REQUIRE(green == ((upright ? x : y) < 12 ? 40 : 200));
            }
        }
    }
}
