// SPDX-License-Identifier: Apache-2.0
/// A painted image on a surface: motifs drawn once, looked up with the caller's filter.
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
    /// `width_mm` repeats (a wrapped surface); beyond the height the edge continues.
    Raster(double width_mm, double height_mm, double texel_mm, const Colour &ground);

    /// Draws where `inside_mm` (distance to the motif's edge, positive within) says so; `box` is
    /// low x, low y, high x, high y. Edges are soft over `soft_mm`.
    template <class Inside>
    void paint(const double (&box)[4], const Colour &colour, double soft_mm, double strength,
               Inside inside_mm);
    /// Makes the prefiltered copies; after the last paint.
    void finish();

    /// Reflectance at a place, through a filter of this rms radius.
    double at(int channel, double x_mm, double y_mm, double rms_mm) const;

    /// The same through a uniform disk whose images of two radii square to each other are
    /// `axes_mm`.
    double under_disk(int channel, Vec2 middle_mm, const Vec2 (&axes_mm)[2]) const;

    bool empty() const { return levels_.empty(); }
    double width_mm() const { return width_mm_; }
    double height_mm() const { return height_mm_; }
    int columns() const { return levels_[0].columns; }
    double columns_per_mm() const { return per_mm_; }
    /// The column in which x lies; 0 <= x_mm < width_mm().
    std::size_t column_of(double x_mm) const { return static_cast<std::size_t>(x_mm * per_mm_); }

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

    double width_mm_ = 0;
    double height_mm_ = 0;
    double per_mm_ = 0;
    std::vector<Level> levels_;
};

/// Ornaments by name: "garden" (the decorated cylinder), "meadow" (the mug).
/// Their drawing is the same for the same seed.
Raster draw_ornament(const std::string &name, double width_mm, double height_mm,
                     const Colour &ground, std::uint64_t seed);
bool is_ornament(const std::string &name);

template <class Inside>
void Raster::paint(const double (&box)[4], const Colour &colour, double soft_mm, double strength,
                   Inside inside_mm) {
    Level &level = levels_[0];
    const auto column = [this](double mm) { return static_cast<int>(std::floor(mm * per_mm_)); };
    const int top = column(box[1]) < 0 ? 0 : column(box[1]);
    const int bottom = column(box[3]) >= level.rows ? level.rows - 1 : column(box[3]);
    std::uint8_t paint[3];
    for (int c = 0; c < 3; c++) {
        paint[c] = static_cast<std::uint8_t>(
            std::lround(255 * std::sqrt(std::fmin(std::fmax(colour.channel[c], 0.0), 1.0))));
    }
    for (int y = top; y <= bottom; y++) {
        for (int x = column(box[0]); x <= column(box[2]); x++) {
            const double d = inside_mm((x + 0.5) / per_mm_, (y + 0.5) / per_mm_);
            const double part = d / soft_mm + 0.5;
            if (part <= 0) {
                continue;
            }
            const double cover = strength * (part < 1 ? part : 1);
            const int wrapped = ((x % level.columns) + level.columns) % level.columns;
            std::uint8_t *texel =
                &level.texels[3 * static_cast<std::size_t>(y * level.columns + wrapped)];
            for (int c = 0; c < 3; c++) {
                texel[c] =
                    static_cast<std::uint8_t>(texel[c] + cover * (paint[c] - texel[c]) + 0.5);
            }
        }
    }
}

}  // namespace world

#endif
