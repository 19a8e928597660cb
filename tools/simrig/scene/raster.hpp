// SPDX-License-Identifier: Apache-2.0
/// An image on a surface, looked up with the caller's filter.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_RASTER_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_RASTER_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "tools/simrig/world/vec.hpp"

namespace world {

class Raster {
  public:
    Raster() = default;
    /// The PNG image at `path`, stretched to this size; a texel is the square root of reflectance.
    /// The width repeats (a wrapped surface), beyond the height the edge continues. Throws BadFile
    /// when it cannot be read, or is not 64 to 16384 pixels wide in steps of 64, and up to 16384
    /// high.
    Raster(const std::string &path, Vec2 size_mm);

    /// Reflectance at a place, through a filter of this rms radius.
    double at(int channel, double x_mm, double y_mm, double rms_mm) const;

    /// The same through a uniform disk whose images of two radii square to each other are
    /// `axes_mm`.
    double under_disk(int channel, Vec2 middle_mm, const Vec2 (&axes_mm)[2]) const;

    bool empty() const { return levels_.empty(); }
    double width_mm() const { return width_mm_; }
    double height_mm() const { return height_mm_; }

  private:
    struct Level {
        int columns = 0;
        int rows = 0;
        std::vector<std::uint8_t> texels;  // square root of reflectance; three channels
    };
    /// `value`: of a stored number, what is joined linearly.
    template <class Value>
    double at_level(const Level &level, double scale, int channel, double x, double y,
                    Value value) const;

    // Prefiltered copies of the image, each half as wide and high.
    void make_copies();

    double width_mm_ = 0;
    double height_mm_ = 0;
    double per_mm_ = 0;
    std::vector<Level> levels_;
};

}  // namespace world

#endif
