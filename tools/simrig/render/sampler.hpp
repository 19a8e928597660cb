// SPDX-License-Identifier: Apache-2.0
/// The light on one pixel: rays over its area and over the pupil, as many as its noise requires.
#ifndef VERGENCE_TOOLS_SIMRIG_RENDER_SAMPLER_HPP
#define VERGENCE_TOOLS_SIMRIG_RENDER_SAMPLER_HPP

#include <vector>

#include "tools/simrig/render/sampler_types.hpp"
#include "tools/simrig/world/camera.hpp"

namespace world {

PixelView pixel_view(const Camera &camera, Vec2 pixel, Vec2 guess);

/// What a ray through a pixel's corner meets.
struct Corner {
    const Object *object = nullptr;
    double z = 0;
    /// Of bodies with parts of different colours, whose edges are sharp.
    int tone = 0;
    Vec3 normal;
};

Corner corner_at(const PixelView &pixel, Vec2 offset_px, Vec2 pupil,
                 const std::vector<Candidate> &candidates);

/// Light where the pixel's middle ray meets a sheet that covers it.
LocalLight light_on_sheet(const View &view, const PixelView &pixel, const Candidate &candidate);

/// Mean luminance over the pixel and the pupil.
double pixel_luminance(const View &view, const PixelTask &task);

/// The same where one ray at each moment does. False: more are needed.
bool smooth_pixel_luminance(const View &view, const PixelTask &task, double &luminance);

/// The same in all colours, by this number of rays of the views' own colour.
Colour area_luminance(const View &view, const PixelTask &task, int rays);

}  // namespace world

#endif
