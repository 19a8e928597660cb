// SPDX-License-Identifier: Apache-2.0
#include "synthetic/board_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/base/marker.hpp"

namespace synthetic {

namespace {

constexpr int fine = 3;       // the blur works on pixels a third as wide
constexpr int samples = 144;  // samples in each fine pixel that an edge crosses

// The paint of the board: each point has one of a few grey levels.
class Paint {
  public:
    Paint(const calib::board &board, const BoardLight &light)
        : board_(board),
          light_(light),
          dictionary_(calib::marker_dictionary_named(board.dictionary)) {}

    double at(double x_mm, double y_mm) const {
        const double u = x_mm / board_.square_mm + 1, v = y_mm / board_.square_mm + 1;
        double grey = painted(u, v);
        for (const double ink : {-light_.ink_squares, light_.ink_squares}) {
            if (ink == 0) {
                break;
            }
            grey = std::min({grey, painted(u + ink, v + ink), painted(u + ink, v - ink)});
        }
        return grey;
    }

  private:
    double painted(double u, double v) const {
        const double columns = board_.columns + 1, rows = board_.rows + 1;
        const double margin = light_.margin_squares;
        if (u < -margin || v < -margin || u > columns + margin || v > rows + margin) {
            return light_.background_grey;
        }
        if (u < 0 || v < 0 || u >= columns || v >= rows) {
            return light_.light_grey;
        }
        const int column = static_cast<int>(u), row = static_cast<int>(v);
        if (calib::board_square_white(column, row) == light_.white_first) {
            return light_.dark_grey;
        }
        return dictionary_ != nullptr && marker_black(column, row, u - column, v - row)
                   ? light_.dark_grey
                   : light_.light_grey;
    }

    bool marker_black(int column, int row, double u, double v) const {
        const double share = board_.marker_mm / board_.square_mm;
        const int cells = dictionary_->side + 2;
        const double x = ((u - 0.5) / share + 0.5) * cells, y = ((v - 0.5) / share + 0.5) * cells;
        if (x < 0 || y < 0 || x >= cells || y >= cells) {
            return false;
        }
        const int bit_column = static_cast<int>(x) - 1, bit_row = static_cast<int>(y) - 1;
        const int side = dictionary_->side;
        if (bit_column < 0 || bit_row < 0 || bit_column >= side || bit_row >= side) {
            return true;
        }
        // Both layouts number the white squares along the rows.
        const int before = row * (board_.columns + 1) + column;
        const int id =
            light_.white_first ? before / 2 : calib::board_marker_id(board_, column, row);
        const calib::marker_code code = dictionary_->codes[id];
        return (code >> (side * side - 1 - bit_row * side - bit_column) & 1) == 0;
    }

    const calib::board &board_;
    const BoardLight &light_;
    const calib::marker_dictionary *dictionary_;
};

// Intersection of the image's rays with the board's plane. Between the corners of a pixel the
// distortion is practically linear.
class PlaneMap {
  public:
    PlaneMap(const Camera &camera, const BoardPose &pose)
        : camera_(camera),
          R_(transpose(pose.R_camera_board)),
          origin_(R_ * (-1 * pose.t_camera_board_mm)) {}

    Vector ray(double x, double y) const { return camera_.ray({x, y}); }
    // Far away from the board when the ray misses the plane.
    Pixel on_board(const Vector &in_camera) const {
        const Vector ray = R_ * in_camera;
        const double range = -origin_.z / ray.z;
        if (!(range > 0)) {
            return {1e9, 1e9};
        }
        return {origin_.x + range * ray.x, origin_.y + range * ray.y};
    }

  private:
    const Camera &camera_;
    Matrix R_;
    Vector origin_;
};

struct PixelCorners {
    Vector topleft, topright, bottomleft, bottomright;
    Vector at(double u, double v) const {
        const auto mix = [&](double a, double b, double c, double d) {
            return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
        };
        return {mix(topleft.x, topright.x, bottomleft.x, bottomright.x),
                mix(topleft.y, topright.y, bottomleft.y, bottomright.y),
                mix(topleft.z, topright.z, bottomleft.z, bottomright.z)};
    }
};

// The mean over a fine pixel that begins at (u0, v0), whose corners do not all have the same paint.
template <typename Grey>
double mean_in(const Grey &grey, double u0, double v0) {
    // A lattice that is fine along both axes: no two samples share a row or a column, so edges
    // along the pixel grid are no worse than others. 89 / 144 is a ratio of Fibonacci numbers.
    double sum = 0;
    for (int i = 0; i < samples; i++) {
        sum +=
            grey(u0 + (i + 0.5) / samples / fine, v0 + (i * 89 % samples + 0.5) / samples / fine);
    }
    return sum / samples;
}

// The greys of the fine pixels of a pixel, row by row.
template <typename Grey>
std::array<double, fine * fine> fine_greys(const Grey &grey) {
    constexpr int side = fine + 1;
    std::array<double, side * side> corner;
    for (int i = 0; i < side * side; i++) {
        corner[size_t(i)] = grey(double(i % side) / fine, double(i / side) / fine);
    }
    std::array<double, fine * fine> greys;
    for (int i = 0; i < fine * fine; i++) {
        const double u0 = double(i % fine) / fine, v0 = double(i / fine) / fine;
        const double *at = &corner[size_t(i / fine * side + i % fine)];
        const bool plain = at[0] == at[1] && at[0] == at[side] && at[0] == at[side + 1] &&
                           at[0] == grey(u0 + 0.5 / fine, v0 + 0.5 / fine);
        greys[size_t(i)] = plain ? at[0] : mean_in(grey, u0, v0);
    }
    return greys;
}

// The sharp image, `fine` times as large each way.
std::vector<float> sharp(const PlaneMap &map, const Paint &paint, const Camera &camera) {
    const size_t width = static_cast<size_t>(camera.width);
    std::vector<float> image(width * fine * static_cast<size_t>(camera.height) * fine);
    std::vector<Vector> upper(width + 1), lower(width + 1);
    const auto rays = [&](int y, std::vector<Vector> *row) {
        for (size_t x = 0; x <= width; x++) {
            (*row)[x] = map.ray(static_cast<double>(x) - 0.5, y - 0.5);
        }
    };
    rays(0, &upper);
    for (int y = 0; y < camera.height; y++) {
        rays(y + 1, &lower);
        for (size_t x = 0; x < width; x++) {
            const PixelCorners pixel = {upper[x], upper[x + 1], lower[x], lower[x + 1]};
            const auto greys = fine_greys([&](double u, double v) {
                const Pixel p = map.on_board(pixel.at(u, v));
                return paint.at(p.x, p.y);
            });
            for (size_t i = 0; i < greys.size(); i++) {
                const size_t row = static_cast<size_t>(y) * fine + i / fine;
                image[row * width * fine + x * fine + i % fine] = static_cast<float>(greys[i]);
            }
        }
        std::swap(upper, lower);
    }
    return image;
}

std::vector<float> kernel_of(double sigma) {
    const int reach = static_cast<int>(4 * sigma + 1);
    std::vector<float> kernel;
    double sum = 0;
    for (int i = -reach; i <= reach; i++) {
        sum += std::exp(-i * i / (2 * sigma * sigma));
    }
    for (int i = -reach; i <= reach; i++) {
        kernel.push_back(static_cast<float>(std::exp(-i * i / (2 * sigma * sigma)) / sum));
    }
    return kernel;
}

// Along rows, transposing the result: applied twice it blurs the image.
std::vector<float> blurred_and_turned(const std::vector<float> &image, size_t width, size_t height,
                                      const std::vector<float> &kernel) {
    const size_t reach = kernel.size() / 2;
    std::vector<float> made(image.size()), padded(width + 2 * reach), row(width);
    for (size_t y = 0; y < height; y++) {
        const float *from = image.data() + y * width;
        std::fill(padded.begin(), padded.begin() + static_cast<ptrdiff_t>(reach), from[0]);
        std::copy(from, from + width, padded.begin() + static_cast<ptrdiff_t>(reach));
        std::fill(padded.end() - static_cast<ptrdiff_t>(reach), padded.end(), from[width - 1]);
        std::fill(row.begin(), row.end(), 0.0F);
        for (size_t k = 0; k < kernel.size(); k++) {
            for (size_t x = 0; x < width; x++) {
                row[x] += kernel[k] * padded[x + k];
            }
        }
        for (size_t x = 0; x < width; x++) {
            made[x * height + y] = row[x];
        }
    }
    return made;
}

}  // namespace

BoardPose hold_board(const calib::board &board, const Camera &camera, const BoardHold &hold) {
    BoardPose pose;
    pose.R_camera_board = rotation_from_vector(hold.turn_rad);
    const double depth_mm =
        camera.fx * (board.columns + 1) * board.square_mm / (hold.width_share * camera.width);
    const Vector centre = {(board.columns - 1) * board.square_mm / 2,
                           (board.rows - 1) * board.square_mm / 2, 0};
    const Vector place = {hold.shift_x * camera.width * depth_mm / camera.fx,
                          hold.shift_y * camera.height * depth_mm / camera.fy, depth_mm};
    pose.t_camera_board_mm = place - pose.R_camera_board * centre;
    return pose;
}

BoardImage photograph(const calib::board &board, const Camera &camera, const BoardPose &pose,
                      const BoardLight &light) {
    BoardImage image;
    image.width = camera.width;
    image.height = camera.height;
    Camera own = camera;
    own.R_camera_world = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    own.centre_mm = {};
    own.vertical = {};
    for (int index = 0; index < board.corner_count(); index++) {
        const Vector on_board = {index % board.columns * board.square_mm,
                                 index / board.columns * board.square_mm, 0};
        const auto seen = own.project(pose.R_camera_board * on_board + pose.t_camera_board_mm);
        image.corners.push_back(seen.value_or(Pixel{-1e9, -1e9}));
    }
    const size_t width = static_cast<size_t>(camera.width) * fine;
    const size_t height = static_cast<size_t>(camera.height) * fine;
    std::vector<float> greys = sharp(PlaneMap(own, pose), Paint(board, light), own);
    const std::vector<float> kernel = kernel_of(std::max(0.05, light.blur_px * fine));
    greys = blurred_and_turned(greys, width, height, kernel);
    greys = blurred_and_turned(greys, height, width, kernel);
    Random random(light.seed);
    for (size_t y = 0; y < height; y += fine) {
        for (size_t x = 0; x < width; x += fine) {
            double sum = 0;
            for (size_t j = 0; j < fine; j++) {
                for (size_t i = 0; i < fine; i++) {
                    sum += double{greys[(y + j) * width + x + i]};
                }
            }
            const double lit =
                1 - light.shade * static_cast<double>(x) / static_cast<double>(width);
            const double grey = sum / (fine * fine) * lit + light.noise_grey * random.normal();
            image.pixels.push_back(static_cast<uint8_t>(std::lround(std::clamp(grey, 0.0, 255.0))));
        }
    }
    return image;
}

}  // namespace synthetic
