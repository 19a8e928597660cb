// SPDX-License-Identifier: Apache-2.0
/// Colour scales whose equal steps look equal: paths through the OKLab colour space, walked at
/// constant speed. Source of the space: B. Ottosson, "A perceptual color space for image
/// processing", 2020.
#ifndef VERGENCE_TOOLS_HOST_COLORMAP_HPP
#define VERGENCE_TOOLS_HOST_COLORMAP_HPP

#include <array>
#include <cstdint>

using colormap_rgb = std::array<std::uint8_t, 3>;  // sRGB
using colormap_table = std::array<colormap_rgb, 256>;

/// Dark violet over blue and green to bright yellow; lightness rises all the way, so the order of
/// values survives grey printing and colour blindness.
colormap_table colormap_sequential();

/// Blue over light grey to red: signed values about zero.
colormap_table colormap_diverging();

#endif
