// SPDX-License-Identifier: Apache-2.0
/// Perceptually uniform colour scales: paths through the OKLab colour space, sampled at equal
/// distances. Source of the space: B. Ottosson, "A perceptual color space for image processing",
/// 2020.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_COLORMAP_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_COLORMAP_HPP

#include <array>
#include <cstdint>

#include "stereo/image/reason.h"

using colormap_rgb = std::array<std::uint8_t, 3>;  // sRGB
using colormap_table = std::array<colormap_rgb, 256>;

/// Dark violet over blue and green to bright yellow; lightness increases monotonically, so the
/// order of values survives grey printing and colour blindness.
colormap_table colormap_sequential();

/// Blue over light grey to red: signed values about zero.
colormap_table colormap_diverging();

/// Colours of enum reason that colour-blind users can distinguish (M. Okabe and K. Ito, 2008);
/// valid pixels are pale, to emphasise what is missing.
constexpr colormap_rgb colormap_reasons[REASON_COUNT] = {
    {0xdc, 0xe6, 0xe4}, {0x8a, 0x93, 0x98}, {0x00, 0x72, 0xb2},
    {0xe6, 0x9f, 0x00}, {0xcc, 0x79, 0xa7}, {0xd5, 0x5e, 0x00},
    {0x3a, 0x30, 0x8a}, {0x00, 0x9e, 0x73}, {0x56, 0xb4, 0xe9}};

#endif
