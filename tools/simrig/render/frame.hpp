// SPDX-License-Identifier: Apache-2.0
/// Requests to a camera and the frames that it returns.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_FRAME_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_FRAME_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include "tools/simrig/scene/scene.hpp"
#include "tools/simrig/world/camera.hpp"

namespace world {

/// Part of the active array (2048 x 1536; 0, 0 is its first pixel), and its skipping.
/// Colours stay GRBG: pixels go in pairs. Output column j is array column
/// column + skip_x * 2 (j / 2) + j % 2, and with binning the mean of bin_x columns 2 apart from
/// there.
struct Window {
    int column = 0;
    int row = 0;
    int columns = kArrayColumns;  ///< array columns
    int rows = kArrayRows;
    int skip_x = 1;
    int skip_y = 1;
    int bin_x = 1;  ///< factor of binning, skip_x or less
    int bin_y = 1;

    int output_columns() const { return columns / (2 * skip_x) * 2; }
    int output_rows() const { return rows / (2 * skip_y) * 2; }
    /// Array position of the n-th binned column or row behind an output one.
    int array_column(int output, int n) const {
        return column + skip_x * 2 * (output / 2) + output % 2 + 2 * n;
    }
    int array_row(int output, int n) const {
        return row + skip_y * 2 * (output / 2) + output % 2 + 2 * n;
    }
    /// Where the middle of an output pixel lies on the array.
    Vec2 centre(int output_column, int output_row) const {
        return {array_column(output_column, 0) + bin_x - 1.0,
                array_row(output_row, 0) + bin_y - 1.0};
    }
    /// Empty when the window is valid, otherwise what is wrong with it.
    const char *fault() const;
    bool operator==(const Window &other) const {
        return std::tie(column, row, columns, rows, skip_x, skip_y, bin_x, bin_y) ==
               std::tie(other.column, other.row, other.columns, other.rows, other.skip_x,
                        other.skip_y, other.bin_x, other.bin_y);
    }
};

struct Gains {
    double analog[4] = {1, 1, 1, 1};  ///< G of red rows, R, B, G of blue rows
    double digital[4] = {1, 1, 1, 1};
};

struct FrameRequest {
    Window window;
    double exposure_us = 20000;
    Gains gains;
    /// Rolling shutter: output row r is exposed from start + r row_time on, for exposure_us.
    double start_time_us = 0;
    double row_time_us = 53.3125;
    std::function<Mechanics(double time_us)> mechanics;
    /// The scene's light at a time, as a share of what its file has. Empty: all of it.
    std::function<double(double time_us)> light;
    std::uint64_t seed = 1;
    std::uint64_t frame = 0;  ///< chosen by the caller: noise of two frames differs
    int threads = 1;
};

struct Frame {
    int columns = 0;
    int rows = 0;
    std::vector<std::uint16_t> pixels;  ///< 10 bits, GRBG
};

/// The light of the last frame of a camera at rest. The frames of one that does not move meanwhile
/// differ only in their noise.
struct StillLight {
    const Scene *scene = nullptr;  ///< null: none
    Side side = Side::kLeft;
    Window window;
    Mechanics mechanics;
    std::uint64_t seed = 0;
    double lit_us = 0;
    std::vector<float> lux;  ///< of each binned pixel, row by row

    /// Whether it is the light of what `other` asks for.
    bool of(const StillLight &other) const {
        return scene == other.scene && side == other.side && window == other.window &&
               mechanics == other.mechanics && seed == other.seed && lit_us == other.lit_us;
    }
};

/// Renders a frame. Bytes depend on all arguments but the number of threads and what `kept` (null:
/// nothing is kept) has. `kept` belongs to one scene and rig, which do not change meanwhile.
/// Throws std::invalid_argument when the window is invalid (Window::fault) or mechanics is empty.
Frame render(const Scene &scene, const Rig &rig, Side side, const FrameRequest &request,
             StillLight *kept = nullptr);

/// Truth of a frame, for the middle of each output pixel (the pinhole's ray).
struct Truth {
    int columns = 0;
    int rows = 0;
    Window window;
    bool mirrored_x = false;  ///< the output of the window is mirrored left to right
    bool mirrored_y = false;
    std::vector<float> depth_mm;       ///< z in the camera's frame; 0 where nothing is seen
    std::vector<float> normal;         ///< three a pixel, in the camera's frame
    std::vector<std::uint8_t> id;      ///< number of the object; 0 is nothing
    std::vector<std::string> objects;  ///< their names, the first is that of id 1
    /// The camera in the middle of each row's exposure: one for all when nothing moves.
    std::vector<Camera> cameras;

    /// Sets all layers of a pixel to those of another truth's.
    void take(std::size_t pixel, const Truth &from, std::size_t from_pixel) {
        depth_mm[pixel] = from.depth_mm[from_pixel];
        for (std::size_t i = 0; i < 3; i++) {
            normal[3 * pixel + i] = from.normal[3 * from_pixel + i];
        }
        id[pixel] = from.id[from_pixel];
    }
    const Camera &camera(int row) const {
        return cameras.size() == 1 ? cameras[0] : cameras[static_cast<std::size_t>(row)];
    }
};

Truth truth(const Scene &scene, const Rig &rig, Side side, const FrameRequest &request);

}  // namespace world

#endif
