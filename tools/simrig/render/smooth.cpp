// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/smooth.hpp"

namespace world {
namespace {

// Between a block's corners: number(0) and (1) above, (2) and (3) below.
template <class Number>
double mix(Vec2 place, Number number) {
    const double upper = number(0) * (1 - place.x) + number(1) * place.x;
    const double lower = number(2) * (1 - place.x) + number(3) * place.x;
    return upper + place.y * (lower - upper);
}

// Light on a block's pixel.
LocalLight between(const BlockLight &block, Vec2 place, int channel) {
    const LocalLight *at = block.corner;
    LocalLight light;
    light.lux[channel] = mix(place, [=](int i) { return at[i].lux[channel]; });
    light.sheen[channel] = mix(place, [=](int i) { return at[i].sheen[channel]; });
    light.slant = {mix(place, [=](int i) { return at[i].slant.x; }),
                   mix(place, [=](int i) { return at[i].slant.y; })};
    return light;
}

// A pixel of one smooth surface: what its middle ray meets, and how its rays spread there.
struct Spread {
    const Object *object;
    Vec3 middle;     // hit of the middle ray in the object's frame
    Vec3 direction;  // direction of the middle ray, not of length 1
    Vec3 normal;
    double slant;    // sine of the angle between ray and surface
    double filter2;  // mm^2, square to the ray: of pixel and pupil
    double spot_mm;
    double texture;
    double blur_mm;
    double pixel_mm;
    LocalLight light;
    bool even_light;  // all over the blur
    int tone;
    const Pose *object_camera;
    double z;
};

SurfacePlace place_of(const Spread &s, const Vec3 &p) {
    SurfacePlace place;
    place.p = p;
    place.met = s.middle;
    place.n = s.normal;
    place.tone = s.tone;
    place.spot_mm = s.spot_mm;
    place.texture = s.texture;
    place.slant = s.light.slant;
    if (s.object->solid == nullptr) {
        place.on_sheet = true;
        place.sheet = s.object->sheet.place(p);
    }
    return place;
}

double reflected(const Spread &s, const Vec3 &p, double rms_mm, double edge_mm, int channel) {
    SurfacePlace place = place_of(s, p);
    place.rms_mm = rms_mm;
    place.edge_mm = edge_mm;
    return std::max(reflectance(s.object->material, place, channel), 0.0);
}

int count_filters(double along, double across) {
    if (along < 1.4 * across) {
        return 1;
    }
    return along < 2.5 * across ? 2 : 3;
}

// Textures of noise, through a filter that is as long as the slant makes it: up to three round ones
// in a row, whose second moment is that of the whole.
double filtered_along(const Spread &s, int channel) {
    const double min = s.object->solid == nullptr ? 0.12 : 0.3;
    const double across = std::sqrt(s.filter2 + s.spot_mm * s.spot_mm);
    const double along = across / std::max(s.slant, min);
    const int count = count_filters(along, across);
    if (count == 1) {
        return reflected(s, s.middle, std::sqrt(along * across), std::sqrt(s.filter2), channel);
    }
    // Equal steps of 2.5 radii leave 4 % of a wave that is as long as a step.
    const double step = along / std::sqrt((count * count - 1) / 12.0 + 0.16);
    const Vec3 flat = s.direction - dot(s.direction, s.normal) * s.normal;
    const Vec3 axis = (step / length(flat)) * flat;
    double sum = 0;
    for (int i = 0; i < count; i++) {
        sum += reflected(s, s.middle + (i - 0.5 * (count - 1)) * axis, 0.4 * step,
                         std::sqrt(s.filter2), channel);
    }
    return sum / count;
}

// Textures with edges: four rays through places of pixel and pupil that lie opposite to each other.
// Slopes cancel between them, so that their mean is much better than their differences say. The
// places are the same for all pixels and frames: chance must not decide whether the differences are
// small enough, because a ray's filter has another shape than the pixel, and its error would
// flicker.
double filtered_in_four(const Spread &s, int channel, double &spread2) {
    constexpr double kPart = 0.6;  // share of the way to the pixel's corner and to the pupil's rim
    const double filter2 = kFiltered * s.filter2;
    const double rms = std::sqrt((filter2 + s.spot_mm * s.spot_mm) / std::max(s.slant, 0.05));
    const double edge = std::sqrt(filter2);
    // Beyond the focus the picture of the pupil is turned.
    const double reach = kPull * kPart * (0.5 * s.pixel_mm + s.blur_mm * std::sqrt(0.5));
    double sum = 0;
    spread2 = 0;
    for (const Vec2 diagonal : {Vec2{reach, reach}, Vec2{reach, -reach}}) {
        // On the tangent plane.
        const Vec3 aside = s.object_camera->rotation * Vec3{diagonal.x, diagonal.y, 0};
        const Vec3 on_plane =
            aside - (dot(s.normal, aside) / dot(s.normal, s.direction)) * s.direction;
        const double one = reflected(s, s.middle + on_plane, rms, edge, channel);
        const double other = reflected(s, s.middle - on_plane, rms, edge, channel);
        sum += one + other;
        spread2 += (one - other) * (one - other);
    }
    return 0.25 * sum;
}

bool has_edges(const Material &material) {
    return material.kind == MaterialKind::kBoard || material.kind == MaterialKind::kPainted;
}

// Ornaments more out of focus than this are seen through a disk: two rays would make grain there.
constexpr double kBlurredPx = 2;
// At a flatter angle than this the disk is too long for its places.
constexpr double kMinSlant = 0.35;

// An ornament through the whole blur at once. False: it is not one surface under the disk.
bool filtered_by_disk(const Spread &s, int channel, double &reflectance) {
    if (s.slant < kMinSlant) {
        return false;
    }
    const Mat3 &turn = s.object_camera->rotation;
    // Of a disk with the second moment of blur, pixel and spot: along x and y of the camera, and
    // from there along the ray to the tangent plane.
    const double radius = 2 * std::sqrt(s.filter2 + s.spot_mm * s.spot_mm);
    const double per_facing = 1 / dot(s.normal, s.direction);
    const auto on_plane = [&](const Vec3 &aside) {
        return radius * (aside - (per_facing * dot(s.normal, aside)) * s.direction);
    };
    SurfacePlace place = place_of(s, s.middle);
    place.rms_mm = 0.5 * radius / std::sqrt(s.slant);
    const Vec3 axes[2] = {on_plane({turn.row0.x, turn.row1.x, turn.row2.x}),
                          on_plane({turn.row0.y, turn.row1.y, turn.row2.y})};
    return painted_under_disk(s.object->material, place, axes, channel, reflectance);
}

// What the middle ray meets of the block's body, near where its corners say.
bool meet_patch(const Patch &patch, const Segment &ray, Vec2 place, Found &found, Vec3 &normal) {
    const Candidate &candidate = *patch.candidate;
    const Pose &pose = candidate.object_camera;
    const Vec3 *n = patch.normal;
    normal = {mix(place, [=](int i) { return n[i].x; }), mix(place, [=](int i) { return n[i].y; }),
              mix(place, [=](int i) { return n[i].z; })};
    const Vec3 origin = pose * Vec3{ray.pupil_mm.x, ray.pupil_mm.y, 0};
    const Vec3 direction = pose.rotation * Vec3{ray.slopes.x, ray.slopes.y, 1};
    double z = mix(place, [&patch](int i) { return patch.z[i]; });
    for (int i = 0; i < 4; i++) {
        const Vec3 p = origin + z * direction;
        const double d = candidate.object->solid->distance(p, candidate.parts);
        if (std::fabs(d) <= kTouchMm) {
            found = {&candidate, z, p, direction};
            return true;
        }
        z -= d / dot(normal, direction);
    }
    return false;
}

// What the middle ray meets, its normal and its light. False: nothing.
bool meet_middle(const View &view, const PixelMoment &moment, int channel, Remembered &memory,
                 Spread &s) {
    const PixelView &pixel = moment.view;
    const Segment middle = segment(pixel, {}, {});
    Found found;
    const bool patched = moment.patch != nullptr &&
                         meet_patch(*moment.patch, middle, moment.block_place, found, s.normal);
    if (!patched) {
        found = first_met(*moment.candidates, middle, moment.z_from);
    }
    if (found.candidate == nullptr) {
        return false;
    }
    s.object = found.candidate->object;
    s.blur_mm = pixel.pupil_radius_mm * std::fabs(1 - found.z / pixel.focus_mm);
    s.pixel_mm = pixel.pixel_slope * found.z;
    if (patched) {
        s.light = between(moment.patch->light, moment.block_place, channel);
    } else if (moment.block_light != nullptr) {
        s.light = between(*moment.block_light, moment.block_place, channel);
        s.normal = s.object->sheet.normal(found.p);
    } else {
        remember(view, found, s.blur_mm + s.pixel_mm, memory);
        s.light = memory.light;
        s.normal = memory.normal;
        s.tone = memory.tone;
    }
    s.even_light = patched || moment.block_light != nullptr;
    s.middle = found.p;
    s.direction = found.direction;
    s.slant = std::fabs(dot(s.normal, found.direction)) / length(found.direction);
    s.filter2 = view.pixel_alone->variance(kWhole) * s.pixel_mm * s.pixel_mm +
                disk_variance(kWhole) * s.blur_mm * s.blur_mm;
    s.spot_mm = view.spot_px * s.pixel_mm;
    s.texture = view.texture;
    s.object_camera = &found.candidate->object_camera;
    s.z = found.z;
    return true;
}

// Mean luminance in weights that a block's light is compared with.
double brightness(const LocalLight &light, int channel) {
    return (0.4 / kPi) * light.lux[channel] + light.sheen[channel];
}

// Light as the whole pupil sees it around a pixel's middle ray, and what that ray meets. False:
// not all rays meet this body.
bool light_of_pixel(const View &view, const PixelView &pixel,
                    const std::vector<Candidate> &candidates, double widest_px, Remembered &middle,
                    Found &found, LocalLight &light) {
    found = first_met(candidates, segment(pixel, {}, {}), 0);
    if (found.candidate == nullptr || found.candidate->object->solid == nullptr ||
        found.candidate->object->material.tones.size() > 1) {
        return false;
    }
    remember(view, found, 0, middle);
    light = middle.light;
    const double blur_mm = pixel.pupil_radius_mm * std::fabs(1 - found.z / pixel.focus_mm);
    if (!has_edges(found.candidate->object->material) ||
        blur_mm < widest_px * pixel.pixel_slope * found.z) {
        return true;
    }
    // Six places, whose second moment is the pupil's.
    constexpr int kPlaces = 6;
    LocalLight sum;
    for (int i = 0; i < kPlaces; i++) {
        const double turn = 2 * kPi / kPlaces * (i + 0.25);
        const Vec2 pupil = std::sqrt(0.5) * Vec2{std::cos(turn), std::sin(turn)};
        const Found aside = first_met(candidates, segment(pixel, {}, pupil), 0);
        if (aside.candidate != found.candidate) {
            return false;
        }
        Remembered there;
        remember(view, aside, 0, there);
        for (int c = 0; c < 3; c++) {
            sum.lux[c] += there.light.lux[c] / kPlaces;
            sum.sheen[c] += there.light.sheen[c] / kPlaces;
        }
    }
    sum.slant = light.slant;
    light = sum;
    return true;
}

}  // namespace

Patch find_patch(const View &view, const PixelView (&views)[5],
                 const std::vector<Candidate> &candidates) {
    // Light is nearly linear where this part of it is not, so a blur over no more pixels than a
    // block has does not change it.
    constexpr double kUneven = 0.004, kBlockPx = 8;
    Patch patch;
    Remembered middle;
    Found found;
    LocalLight light[5];
    Vec3 normal[5];
    for (int i = 0; i < 5; i++) {
        Found one;
        if (!light_of_pixel(view, views[i], candidates, kBlockPx, middle, one, light[i]) ||
            (i > 0 && one.candidate != found.candidate)) {
            return {};
        }
        found = one;
        normal[i] = middle.normal;
        if (i < 4) {
            patch.light.corner[i] = light[i];
            patch.normal[i] = normal[i];
            patch.z[i] = one.z;
        }
    }
    const Material &material = found.candidate->object->material;
    // What is mirrored turns by twice the bend; it is as sharp as the gloss.
    const double bend_rad =
        material.gloss > 0 ? std::min(0.25 * material.gloss_blur_rad, 0.05) : 0.05;
    for (int i = 0; i < 4; i++) {
        const Vec3 bend = normal[i] - normal[4];
        if (dot(bend, bend) > bend_rad * bend_rad) {
            return {};
        }
    }
    for (int c = 0; c < 3; c++) {
        double mean = 0;
        for (int i = 0; i < 4; i++) {
            mean += 0.25 * brightness(light[i], c);
        }
        if (std::fabs(mean - brightness(light[4], c)) > kUneven * mean) {
            return {};
        }
    }
    patch.candidate = found.candidate;
    return patch;
}

bool smooth_luminance(const View &view, const PixelTask &task, const PixelMoment &moment,
                      Remembered &memory, double &luminance) {
    Spread s{};
    if (!meet_middle(view, moment, task.channel, memory, s)) {
        luminance = view.scene->ambient.channel[task.channel];
        return true;
    }
    const double lit = (1 / kPi) * s.light.lux[task.channel];
    const double sheen = s.light.sheen[task.channel];
    if (!has_edges(s.object->material)) {
        luminance = lit * filtered_along(s, task.channel) + sheen;
        return true;
    }
    // Of a flat picture one disk holds pixel, spot and blur, also in focus.
    const bool disk = s.object->solid == nullptr ? moment.block_light != nullptr
                                                 : s.blur_mm > kBlurredPx * s.pixel_mm;
    if (s.object->material.kind == MaterialKind::kPainted && disk) {
        double reflectance = 0;
        if (s.even_light && filtered_by_disk(s, task.channel, reflectance)) {
            luminance = lit * reflectance + sheen;
            return true;
        }
        return false;
    }
    double spread2 = 0;
    luminance = lit * filtered_in_four(s, task.channel, spread2) + sheen;
    const double k = lit * task.electrons_per_luminance;
    return 0.1 * spread2 * k * k <=
           kErrorPart2 * (luminance * task.electrons_per_luminance + task.min_noise_e2);
}

}  // namespace world
