// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/scene/material.hpp"

#include <algorithm>
#include <cmath>

#include "tools/simrig/world/random.hpp"

namespace world {
namespace {

// A sine of period 1 by two parabolas; its error (0.06) does not matter to wood.
double soft_wave(double x) {
    const double m = x - std::floor(x);
    return m < 0.5 ? 16 * m * (0.5 - m) : -16 * (m - 0.5) * (1 - m);
}

// A layer on a body: looked at along the axes that face the surface, blended between them.
double around(const NoiseLayer &layer, const SurfacePlace &s) {
    double wx = s.n.x * s.n.x;
    double wy = s.n.y * s.n.y;
    double wz = s.n.z * s.n.z;
    wx = std::max(wx * wx - 0.04, 0.0);
    wy = std::max(wy * wy - 0.04, 0.0);
    wz = std::max(wz * wz - 0.04, 0.0);
    double sum = 0;
    if (wx > 0) {
        sum += wx * layer.at(s.p.y + 31, s.p.z, s.rms_mm);
    }
    if (wy > 0) {
        sum += wy * layer.at(s.p.z + 67, s.p.x, s.rms_mm);
    }
    if (wz > 0) {
        sum += wz * layer.at(s.p.x + 11, s.p.y, s.rms_mm);
    }
    // Blending must not make the texture weaker where two directions meet.
    return sum / std::sqrt(wx * wx + wy * wy + wz * wz);
}

// Rough wall: broad tones, trowel marks lit from the side, sand, pits. Sand is two layers that
// never line up, and its places are shifted by the broader layers, so that no period shows.
double plaster(const Material &m, const SurfacePlace &s, int channel) {
    const double u = s.sheet.x;
    const double v = s.sheet.y;
    const double broad = m.layer[0].at(u, v, s.rms_mm);
    const double marks = m.layer[1].at(u, v, s.rms_mm);
    constexpr double kAside = 1.3;
    const double lit = m.layer[1].at(u + kAside * s.slant.x, v + kAside * s.slant.y, s.rms_mm);
    const double su = u + 31 * broad + lit;
    const double sv = v + 23 * broad - 4 * marks;
    const double sand = m.layer[2].at(su, sv, s.rms_mm);
    const double grit = m.layer[3].at(su + sand, sv, s.rms_mm);
    const double pits = std::max(0.0, -grit - 1.1 + 0.5 * broad);
    const double contrast = s.texture * m.contrast;
    const double factor = 1 + contrast * (0.045 * broad + 0.35 * (lit - marks) + 0.02 * marks +
                                          0.055 * sand + 0.036 * grit - 0.12 * pits);
    // Broad tones are a little warmer or colder as well.
    constexpr double kWarm[] = {1, 0, -1};
    const double warm = contrast * 0.018 * broad * kWarm[channel];
    return m.tones[0].channel[channel] * (factor + warm);
}

// One board of the table: years' rings that wander, pores stretched along the grain.
double one_plank(const Material &m, const SurfacePlace &s, int channel, double number) {
    const std::uint64_t key = mixed(static_cast<std::uint64_t>(static_cast<std::int64_t>(number)));
    const double own = unit_interval(key);
    const double u = s.sheet.x + 400 * own;
    const double v = s.sheet.y + 90 * own;
    const double bend = m.layer[0].at(u * 0.12, v, s.rms_mm);
    const double broad = m.layer[0].at(u * 0.5 + 60 * bend, v * 0.7 + 200, s.rms_mm);
    const double pores =
        m.layer[2].at(u * 0.11 + 2 * broad, v + 1.1 * bend + 2.3 * broad, s.rms_mm);
    const double grain = m.layer[3].at(u * 0.16, v * 1.0 + 5 * bend, s.rms_mm);
    const double ring_mm = 7 + 9 * own;
    const double fade = 1 / (1 + 30 * s.rms_mm * s.rms_mm / (ring_mm * ring_mm));
    const double x = (v + 14 * bend + 0.5 * grain) / ring_mm;
    const double ring = soft_wave(x + 0.12 * soft_wave(x)) * fade;
    const double dark = std::max(0.0, -pores - 0.5);
    const double factor =
        1 + 0.30 * (own - 0.5) +
        s.texture * m.contrast *
            (0.11 * ring + 0.05 * broad + 0.07 * grain + 0.035 * pores - 0.20 * dark);
    constexpr double kHue[] = {-0.35, 0, 0.55};
    const double tinted = factor + kHue[channel] * (factor - 1) * 0.6;
    return m.tones[0].channel[channel] * std::max(tinted, 0.15);
}

// Boards along x, with 0.9 mm of shadow between them; all of it as the filter sees it.
double wood(const Material &m, const SurfacePlace &s, int channel) {
    const double plank = s.sheet.y / m.plank_mm;
    const double edge = std::round(plank);
    const double off = (plank - edge) * m.plank_mm;  // distance from the nearest gap
    const double width = std::max(1.7 * s.rms_mm, 0.25);
    const double here = one_plank(m, s, channel, off < 0 ? edge - 1 : edge);
    if (std::fabs(off) > 0.45 + width) {
        return here;
    }
    const double part = std::max(0.5 - 0.5 * std::fabs(off) / width, 0.0);
    const double there = part > 0 ? one_plank(m, s, channel, off < 0 ? edge : edge - 1) : here;
    const double gap = std::clamp((0.45 + width - std::fabs(off)) / (2 * width), 0.0, 1.0) *
                       std::min(1.0, 0.45 / width);
    return (here + part * (there - here)) * (1 - 0.85 * gap);
}

// The ornament is on the outside of the wall that it wraps: neither inside, nor on protruding parts
// such as a handle. A filter softens that only as far as the surface leads off the
// wall: along the wall it stays on it, however wide it is.
double on_wall(const Material &m, const SurfacePlace &s) {
    const double from_axis = std::sqrt(s.met.x * s.met.x + s.met.z * s.met.z);
    const double off = from_axis - m.raster.width_mm() / (2 * kPi);
    const double upright = (s.n.x * s.met.x + s.n.z * s.met.z) / std::max(from_axis, 1e-9);
    const double soft = 0.4 + s.rms_mm * std::sqrt(std::max(1 - upright * upright, 0.0));
    return std::clamp((0.9 - off) / soft, 0.0, 1.0) * std::clamp((off + 2.6) / soft, 0.0, 1.0);
}

// The ornament's own reflectance and the ground's, joined, with the surface's texture.
double glazed(const Material &m, const SurfacePlace &s, double ornament, double wall, double tone,
              double fine, int channel) {
    const double ground = m.tones[0].channel[channel];
    const double base = ground + s.texture * wall * (ornament - ground);
    return base * (1 + s.texture * m.contrast * (0.02 * tone + 0.022 * fine));
}

// Where the ornament is looked up. The brush's edge is not straight in the small.
Vec2 on_ornament(const Material &m, const Vec3 &p, double tone, double fine) {
    const double around_mm = (std::atan2(p.z, p.x) / (2 * kPi) + 0.5) * m.raster.width_mm();
    return {around_mm + 0.07 * fine, p.y + m.raster.height_mm() - 0.07 * tone};
}

// On a sheet the picture's middle is the sheet's.
Vec2 on_print(const Material &m, const SurfacePlace &s) {
    return {s.sheet.x + 0.5 * m.raster.width_mm(), s.sheet.y + 0.5 * m.raster.height_mm()};
}

double printed(const Material &m, double print, const SurfacePlace &s, int channel) {
    return glazed(m, s, print, 1, m.layer[0].at(s.sheet.x, s.sheet.y, s.rms_mm),
                  m.layer[2].at(s.sheet.x, s.sheet.y, s.rms_mm), channel);
}

double painted(const Material &m, const SurfacePlace &s, int channel) {
    if (s.on_sheet) {
        const Vec2 at = on_print(m, s);
        return printed(m, m.raster.at(channel, at.x, at.y, s.rms_mm), s, channel);
    }
    const double wall = on_wall(m, s);
    const double tone = around(m.layer[0], s);
    const double fine = around(m.layer[2], s);
    const Vec2 at = on_ornament(m, s.p, tone, fine);
    return glazed(m, s, m.raster.at(channel, at.x, at.y, s.rms_mm), wall, tone, fine, channel);
}

double plain(const Material &m, const SurfacePlace &s, int channel, double broad, double fine) {
    const double tone = around(m.layer[0], s);
    const double grit = around(m.layer[2], s);
    return m.tones[static_cast<std::size_t>(s.tone)].channel[channel] *
           (1 + s.texture * m.contrast * (broad * tone + fine * grit));
}

double paper(const Material &m, const SurfacePlace &s, int channel) {
    const double tone = m.layer[0].at(s.sheet.x, s.sheet.y, s.rms_mm);
    const double fibre = m.layer[2].at(s.sheet.x + 5 * tone, s.sheet.y - 4 * tone, s.rms_mm);
    double base = m.tones[0].channel[channel];
    if (m.kind == MaterialKind::kBoard) {
        const double white = board_white(m.board, s.sheet, 1.7320508 * s.edge_mm, s.spot_mm);
        const double ink = m.tones[1].channel[channel];
        base = ink + white * (base - ink);
    }
    return base * (1 + s.texture * m.contrast * (0.008 * tone + 0.02 * fibre));
}

}  // namespace

void prepare(Material &m, int number) {
    const int k = 7 * number;
    switch (m.kind) {
        case MaterialKind::kPlaster:
            m.layer[0] = NoiseLayer(1, 1270, k);
            m.layer[1] = NoiseLayer(1, 223, k + 1);
            m.layer[2] = NoiseLayer(0, 31.7, k + 2);
            m.layer[3] = NoiseLayer(2, 68.3, k + 3);
            break;
        case MaterialKind::kWood:
            // Not turned: the grain runs along the boards.
            m.layer[0] = NoiseLayer(1, 410, 0);
            m.layer[2] = NoiseLayer(0, 27.3, 0);
            m.layer[3] = NoiseLayer(2, 93, 0);
            for (NoiseLayer &layer : m.layer) {
                layer.along = layer.texels_per_mm;
                layer.across = 0;
            }
            break;
        default:
            m.layer[0] = NoiseLayer(1, 167, k);
            m.layer[2] = NoiseLayer(0, 17.9, k + 2);
            break;
    }
}

double reflectance(const Material &material, const SurfacePlace &place, int channel) {
    switch (material.kind) {
        case MaterialKind::kPlaster:
            return plaster(material, place, channel);
        case MaterialKind::kWood:
            return wood(material, place, channel);
        case MaterialKind::kPainted:
            return painted(material, place, channel);
        case MaterialKind::kClay:
            return plain(material, place, channel, 0.018, 0.03);
        case MaterialKind::kPlastic:
            return plain(material, place, channel, 0.008, 0.05);
        case MaterialKind::kBoard:
        case MaterialKind::kPaper:
            break;
    }
    return paper(material, place, channel);
}

bool painted_under_disk(const Material &material, const SurfacePlace &place, const Vec3 (&axes)[2],
                        int channel, double &reflectance) {
    const Material &m = material;
    const Vec3 &p = place.p;
    if (place.on_sheet) {
        const Vec2 flat[2] = {{axes[0].x, axes[0].y}, {axes[1].x, axes[1].y}};
        // Further aside the picture would be looked up beyond its first repetition.
        if (2 * place.rms_mm > 0.9 * m.raster.width_mm()) {
            return false;
        }
        const double print = m.raster.under_disk(channel, on_print(m, place), flat);
        reflectance = std::max(printed(m, print, place, channel), 0.0);
        return true;
    }
    const double from_axis2 = p.x * p.x + p.z * p.z;
    const double out = place.n.x * p.x + place.n.z * p.z;
    constexpr double kUpright2 = 0.98 * 0.98;
    if (on_wall(m, place) < 1 || out < 0 || out * out < kUpright2 * from_axis2) {
        return false;
    }
    const double tone = around(m.layer[0], place);
    const double fine = around(m.layer[2], place);
    // Along the wall a place moves on the ornament by so much for each mm in x and z.
    const double wound = m.raster.width_mm() / (2 * kPi * from_axis2);
    Vec2 flat[2];
    for (int i = 0; i < 2; i++) {
        flat[i] = {wound * (p.x * axes[i].z - p.z * axes[i].x), axes[i].y};
    }
    const double ornament = m.raster.under_disk(channel, on_ornament(m, p, tone, fine), flat);
    reflectance = std::max(glazed(m, place, ornament, 1, tone, fine, channel), 0.0);
    return true;
}

Colour mean_reflectance(const Material &material) {
    Colour mean = material.tones[0];
    if (material.kind == MaterialKind::kBoard) {
        for (int c = 0; c < 3; c++) {
            mean.channel[c] = 0.5 * (mean.channel[c] + material.tones[1].channel[c]);
        }
    }
    return mean;
}

}  // namespace world
