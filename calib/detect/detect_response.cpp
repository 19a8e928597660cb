// SPDX-License-Identifier: Apache-2.0
#include "calib/detect/detect_response.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace calib::detect {

namespace {

constexpr int step_px = 2;  // step of the second differences
constexpr int border_px = 6;
// An ideal corner of contrast c gives about (c/2)^2 when sharp and a tenth of that when blurred.
constexpr float min_response = 9.0F * pixel_scale * pixel_scale;
// Largest distance in x or y of a saddle point from its pixel of highest response.
constexpr double farthest_px = 1.5;

// A buffer of the last few rows, indexed by row number.
template <size_t Count>
class row_ring {
  public:
    explicit row_ring(int width) {
        for (std::vector<float> &row : rows_) {
            row.assign(static_cast<size_t>(width), 0.0F);
        }
    }
    float *operator[](int y) { return rows_[static_cast<size_t>(y) % Count].data(); }
    const float *operator[](int y) const { return rows_[static_cast<size_t>(y) % Count].data(); }

  private:
    std::array<std::vector<float>, Count> rows_;
};

using smooth_rows = row_ring<8>;
using response_rows = row_ring<8>;

// Weights 1 4 6 4 1, vertically, then horizontally.
void smooth_row(const plane &level, int y, std::vector<int> *down, float *out) {
    const int width = level.width;
    const uint16_t *rows[5];
    for (int k = 0; k < 5; k++) {
        rows[k] = level.row(y + k - 2);
    }
    int *column = down->data();
    for (int x = 0; x < width; x++) {
        column[x] = rows[0][x] + rows[4][x] + 4 * (rows[1][x] + rows[3][x]) + 6 * rows[2][x];
    }
    for (int x = 2; x < width - 2; x++) {
        const int sum =
            column[x - 2] + column[x + 2] + 4 * (column[x - 1] + column[x + 1]) + 6 * column[x];
        out[x] = static_cast<float>(sum) * (1.0F / 256.0F);
    }
}

void response_row(const smooth_rows &smooth, int y, int width, float *out) {
    const float *above = smooth[y - step_px], *here = smooth[y], *below = smooth[y + step_px];
    for (int x = 2 + step_px; x < width - 2 - step_px; x++) {
        const float xx = here[x - step_px] - 2 * here[x] + here[x + step_px];
        const float yy = above[x] - 2 * here[x] + below[x];
        const float xy = 0.25F * (above[x - step_px] - above[x + step_px] - below[x - step_px] +
                                  below[x + step_px]);
        out[x] = xy * xy - xx * yy;
    }
}

// On a tie the first pixel wins.
bool highest_of_25(const response_rows &response, int x, int y) {
    const float centre = response[y][x];
    for (int v = -2; v <= 2; v++) {
        const float *row = response[y + v];
        for (int u = -2; u <= 2; u++) {
            const bool earlier = v < 0 || (v == 0 && u < 0);
            if (row[x + u] > centre || (earlier && row[x + u] == centre)) {
                return false;
            }
        }
    }
    return true;
}

// Where the gradient of the quadratic fitted to the smoothed grey levels vanishes.
bool saddle_point(const smooth_rows &smooth, int x, int y, peak *found) {
    const float *above = smooth[y - step_px], *here = smooth[y], *below = smooth[y + step_px];
    const double gx = (here[x + step_px] - here[x - step_px]) / (2.0 * step_px);
    const double gy = (below[x] - above[x]) / (2.0 * step_px);
    const double area = step_px * step_px;
    const double xx = (here[x - step_px] - 2 * here[x] + here[x + step_px]) / area;
    const double yy = (above[x] - 2 * here[x] + below[x]) / area;
    const double xy =
        (above[x - step_px] - above[x + step_px] - below[x - step_px] + below[x + step_px]) /
        (4 * area);
    const double determinant = xx * yy - xy * xy;
    const double dx = (xy * gy - yy * gx) / determinant;
    const double dy = (xy * gx - xx * gy) / determinant;
    found->x = x + dx;
    found->y = y + dy;
    return std::fabs(dx) <= farthest_px && std::fabs(dy) <= farthest_px;
}

void peaks_of_row(const smooth_rows &smooth, const response_rows &response, int y, int width,
                  std::vector<peak> *found) {
    const float *row = response[y];
    for (int x = border_px; x < width - border_px; x++) {
        // Neighbours are checked first because most pixels fail there.
        if (row[x] < min_response || row[x] < row[x - 1] || row[x] < row[x + 1] ||
            !highest_of_25(response, x, y)) {
            continue;
        }
        peak candidate;
        candidate.response = row[x];
        if (saddle_point(smooth, x, y, &candidate)) {
            found->push_back(candidate);
        }
    }
}

}  // namespace

std::vector<peak> saddle_peaks(const plane &level) {
    std::vector<peak> found;
    const int width = level.width, height = level.height;
    if (width <= 2 * border_px || height <= 2 * border_px) {
        return found;
    }
    smooth_rows smooth(width);
    response_rows response(width);
    std::vector<int> down(static_cast<size_t>(width));
    for (int y = 2; y < height - 2; y++) {
        smooth_row(level, y, &down, smooth[y]);
        const int centre = y - step_px;
        if (centre < 2 + step_px) {
            continue;
        }
        response_row(smooth, centre, width, response[centre]);
        const int middle = centre - 2;
        if (middle >= border_px) {
            peaks_of_row(smooth, response, middle, width, &found);
        }
    }
    return found;
}

}  // namespace calib::detect
