// SPDX-License-Identifier: Apache-2.0
/// Appearance of surfaces: reflectance in one channel at a place, through a filter of some width.
#ifndef VERGENCE_TOOLS_SIMRIG_SCENE_MATERIAL_HPP
#define VERGENCE_TOOLS_SIMRIG_SCENE_MATERIAL_HPP

#include <string>
#include <vector>

#include "tools/simrig/scene/board.hpp"
#include "tools/simrig/scene/noise_tile.hpp"
#include "tools/simrig/scene/raster.hpp"

namespace world {

enum class MaterialKind { kPlaster, kWood, kPainted, kClay, kPlastic, kBoard, kPaper };

struct Material {
    MaterialKind kind = MaterialKind::kClay;
    std::vector<Colour> tones;  ///< one, or one for each tone of the parts
    double contrast = 1;        ///< contrast of the fine texture; 0: none
    /// Mirror at right angles (0.04 glaze), and how soft its picture of the lights is, rad.
    double gloss = 0;
    double gloss_blur_rad = 0.1;
    Board board;
    std::string image;  ///< file name of the ornament on a sheet or around a solid; empty: none
    Vec2 image_size_mm;
    Raster raster;  ///< the ornament, once it is loaded
    NoiseLayer layer[4];
    double plank_mm = 120;
};

/// The place of a reflectance lookup.
struct SurfacePlace {
    Vec3 p;      ///< the body's own frame; on the tangent plane of `met`
    Vec3 met;    ///< point where the ray met the body
    Vec3 n;      ///< normal at `met`
    Vec2 sheet;  ///< place on a sheet, from its middle
    bool on_sheet = false;
    int tone = 0;
    double rms_mm = 0;  ///< rms radius of the filter
    /// The same in two parts, not stretched by slant, for boards: a box and the lens's round spot.
    double edge_mm = 0;
    double spot_mm = 0;
    double texture = 1;  ///< share of the contrast of textures and ornaments
    Vec2 slant;          ///< sheets only: sideways part of the light over its upright part
};

/// Sets the layers of noise that this kind needs; `number` makes two surfaces of a kind differ.
void prepare(Material &material, int number);

double reflectance(const Material &material, const SurfacePlace &place, int channel);

/// The same for an ornament that is seen through a uniform disk on the tangent plane, whose images
/// of two radii square to each other are `axes` (mm); rms_mm is that of the whole disk. False: the
/// disk is not on the ornament's wall alone.
bool painted_under_disk(const Material &material, const SurfacePlace &place, const Vec3 (&axes)[2],
                        int channel, double &reflectance);

/// Mean reflectance, for light that comes back from the surface.
Colour mean_reflectance(const Material &material);

}  // namespace world

#endif
