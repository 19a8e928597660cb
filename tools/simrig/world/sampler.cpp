// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/sampler.hpp"

#include <algorithm>

namespace world {
namespace {

// Textures are looked up nearer to the middle of a ray's share of pixel and pupil than the ray
// itself runs; the filter makes up for it, so that second moments stay what they are. Less noise
// for the same rays. kPull is the part of a ray's own offset that remains.
constexpr double kPull = 0.15;
constexpr double kFiltered = 1 - kPull * kPull;
// Rays stop when their standard error is this part of the pixel's own noise.
constexpr double kErrorPart2 = 0.3 * 0.3;

// Distance from a body at which a ray has arrived: a twentieth of a pixel at 10x.
constexpr double kTouchMm = 0.003;

// A pixel begins with two rays through opposite places of the whole pixel and the whole pupil.
constexpr int kWhole = -1;
// Levels 0, 1, 2 have 4, 16, 64 rays.
constexpr int kLastLevel = 2;

// Shirley's map of the square to the disk: shares stay compact. a, b in [-1, 1].
Vec2 disk(double a, double b) {
    const bool flat = std::fabs(a) > std::fabs(b);
    const double r = flat ? a : b;
    const double other = flat ? b : a;
    const double x = r == 0 ? 0 : (kPi / 4) * other / r;
    const double x2 = x * x;
    // |x| <= pi / 4: errors 4e-6.
    const double s = x * (1 - x2 * (1.0 / 6 - x2 * (1.0 / 120 - x2 * (1.0 / 5040))));
    const double c = 1 - x2 * (0.5 - x2 * (1.0 / 24 - x2 * (1.0 / 720)));
    return flat ? Vec2{r * c, r * s} : Vec2{r * s, r * c};
}

// Mean variance a dimension of the unit disk's shares: the whole, and levels 0, 1, 2.
std::array<double, 4> disk_variances() {
    std::array<double, 4> variance{};
    constexpr int kFine = 64;
    for (int level = kWhole; level < 3; level++) {
        const int shares = level == kWhole ? 1 : 2 << level;
        double sum = 0;
        for (int y = 0; y < kFine; y++) {
            for (int x = 0; x < kFine; x++) {
                const auto middle = [shares](int fine) {
                    return (2.0 * (fine * shares / kFine) + 1) / shares - 1;
                };
                const Vec2 p = disk((2.0 * x + 1) / kFine - 1, (2.0 * y + 1) / kFine - 1);
                const Vec2 m = disk(middle(x), middle(y));
                sum += 0.5 * (dot(p, p) - dot(m, m));
            }
        }
        // What the middles lack of the disk's own second moment.
        variance[static_cast<std::size_t>(level + 1)] = sum / (kFine * kFine);
    }
    return variance;
}

const std::array<double, 4> kDiskVariance = disk_variances();

struct Segment {
    Vec2 pupil_mm;
    Vec2 slopes;
};

Segment segment(const PixelView &v, Vec2 offset_px, Vec2 pupil) {
    const Vec2 lens = v.pupil_radius_mm * pupil;
    const Vec2 s = {v.slopes.x + v.step[0] * offset_px.x + v.step[1] * offset_px.y,
                    v.slopes.y + v.step[2] * offset_px.x + v.step[3] * offset_px.y};
    return {lens, s - (1 / v.focus_mm) * lens};
}

struct Found {
    const Candidate *candidate = nullptr;
    double z = 1e30;
    Vec3 p;          // in the object's frame
    Vec3 direction;  // times z
};

// z_from: nothing is met before.
void meet(const Candidate &candidate, const Segment &s, double z_from, Found &best) {
    const Pose &pose = candidate.object_camera;
    const Mat3 &m = pose.rotation;
    const Vec3 origin = {pose.translation_mm.x + m.row0.x * s.pupil_mm.x + m.row0.y * s.pupil_mm.y,
                         pose.translation_mm.y + m.row1.x * s.pupil_mm.x + m.row1.y * s.pupil_mm.y,
                         pose.translation_mm.z + m.row2.x * s.pupil_mm.x + m.row2.y * s.pupil_mm.y};
    const Vec3 direction = {m.row0.x * s.slopes.x + m.row0.y * s.slopes.y + m.row0.z,
                            m.row1.x * s.slopes.x + m.row1.y * s.slopes.y + m.row1.z,
                            m.row2.x * s.slopes.x + m.row2.y * s.slopes.y + m.row2.z};
    const Object &object = *candidate.object;
    double z = -1;
    if (object.solid == nullptr) {
        z = candidate.covers ? -origin.z / direction.z : object.sheet.trace({origin, direction});
    } else {
        const double per_z = length(direction);
        const double t = object.solid->trace(
            {origin, (1 / per_z) * direction}, std::max(candidate.z_near, z_from) * per_z,
            std::min(candidate.z_far, best.z) * per_z, kTouchMm, candidate.parts);
        z = t / per_z;
    }
    if (z > 0 && z < best.z) {
        best = {&candidate, z, origin + z * direction, direction};
    }
}

// Where one ray runs within pixel and pupil, and the middle of its share of them.
struct Course {
    Segment ray;
    Segment middle;
    const Aperture *aperture;
    double spot_px;  // of the lens, where the aperture leaves it to the textures' filter
    const PixelView *pixel;
    const std::vector<Candidate> *candidates;
    int level;
};

// What the samples of one pixel share: light and normal of a place, while they stay near it.
struct Remembered {
    const Object *object = nullptr;
    Vec3 p;
    double reach2 = 0;
    Vec3 normal;
    LocalLight light;
    int tone = 0;
    // Of all rays of the pixel: whether they met one surface without a step.
    const Object *first = nullptr;
    bool one_object = true;
    double z_least = 1e30;
    double z_most = 0;
    double spread_mm = 0;

    void note(const Found &found, double footprint_mm) {
        const Object *met = found.candidate->object;
        one_object = one_object && (first == nullptr || first == met);
        first = met;
        z_least = std::min(z_least, found.z);
        z_most = std::max(z_most, found.z);
        spread_mm = std::max(spread_mm, footprint_mm);
    }
    bool one_surface() const {
        return one_object && first != nullptr && z_most - z_least < 4 * spread_mm &&
               (first->solid == nullptr || first->material.tones.size() == 1);
    }
};

void remember(const View &view, const Found &found, double footprint_mm, Remembered &memory) {
    const Object &object = *found.candidate->object;
    memory.object = &object;
    memory.p = found.p;
    const bool is_sheet = object.solid == nullptr;
    const bool has_tones = !is_sheet && object.material.tones.size() > 1;
    const double reach = is_sheet ? 3 + 3 * footprint_mm : has_tones ? 0 : 0.1 + 0.4 * footprint_mm;
    memory.reach2 = reach * reach;
    memory.normal = is_sheet ? object.sheet.normal(found.p)
                             : object.solid->normal(found.p, found.candidate->parts);
    const Vec3 from_eye = unit(found.direction);
    if (is_sheet && dot(memory.normal, from_eye) > 0) {
        memory.normal = -memory.normal;
    }
    memory.light = light_at(*view.scene, object, found.p, memory.normal, from_eye);
    memory.tone = has_tones ? object.solid->nearest_part(found.p, found.candidate->parts).tone : 0;
}

double shaded(const View &view, const Course &course, const Found &found, int channel,
              Remembered &memory) {
    const PixelView &pixel = *course.pixel;
    const Segment &middle = course.middle;
    const int level = course.level;
    const Object &object = *found.candidate->object;
    const double blur_mm = pixel.pupil_radius_mm * std::fabs(1 - found.z / pixel.focus_mm);
    const double pixel_mm = pixel.pixel_slope * found.z;
    memory.note(found, blur_mm + pixel_mm);
    const Vec3 off = found.p - memory.p;
    if (memory.object != &object || dot(off, off) > memory.reach2) {
        remember(view, found, blur_mm + pixel_mm, memory);
    }
    // Where the middle ray of this share meets the tangent plane.
    const Pose &pose = found.candidate->object_camera;
    const Vec3 origin = pose * Vec3{middle.pupil_mm.x, middle.pupil_mm.y, 0};
    const Vec3 direction = pose.rotation * Vec3{middle.slopes.x, middle.slopes.y, 1};
    const double facing = dot(memory.normal, direction);
    const double z = dot(memory.normal, found.p - origin) / facing;
    SurfacePlace place;
    place.p = place.met = found.p;
    const double filter2 =
        kFiltered * (course.aperture->variance(level) * pixel_mm * pixel_mm +
                     kDiskVariance[static_cast<std::size_t>(level + 1)] * blur_mm * blur_mm);
    if (std::fabs(z - found.z) * std::fabs(facing) < 1.5 * (blur_mm + pixel_mm)) {
        place.p = found.p + (1 - kPull) * (origin + z * direction - found.p);
    }
    // Seen at a slant the filter is longer one way; its mean radius grows with the root.
    const double slant = std::max(std::fabs(facing) / length(direction), 0.05);
    place.spot_mm = course.spot_px * pixel_mm;
    place.edge_mm = std::sqrt(filter2);
    place.rms_mm = std::sqrt((filter2 + place.spot_mm * place.spot_mm) / slant);
    place.n = memory.normal;
    place.tone = memory.tone;
    place.slant = memory.light.slant;
    if (object.solid == nullptr) {
        place.on_sheet = true;
        place.sheet = object.sheet.place(place.p);
    }
    return (1 / kPi) * memory.light.lux[channel] *
               std::max(reflectance(object.material, place, channel), 0.0) +
           memory.light.sheen[channel];
}

double luminance_along(const View &view, const Course &course, int channel, Remembered &memory) {
    Found found;
    for (const Candidate &candidate : *course.candidates) {
        if (candidate.z_near >= found.z) {
            break;
        }
        meet(candidate, course.ray, 0, found);
    }
    if (found.candidate == nullptr) {
        memory.one_object = false;
        return view.scene->ambient.channel[channel];
    }
    return shaded(view, course, found, channel, memory);
}

double centred(unsigned share16) {
    return share16 * (2.0 / 65536) - 1;
}

// Light on a block's pixel, linear between the block's corners.
LocalLight between(const BlockLight &block, double x, double y, int channel) {
    const auto mix = [x, y, &block](auto number) {
        const double upper = number(block.corner[0]) * (1 - x) + number(block.corner[1]) * x;
        const double lower = number(block.corner[2]) * (1 - x) + number(block.corner[3]) * x;
        return upper + y * (lower - upper);
    };
    LocalLight light;
    light.lux[channel] = mix([channel](const LocalLight &l) { return l.lux[channel]; });
    light.sheen[channel] = mix([channel](const LocalLight &l) { return l.sheen[channel]; });
    light.slant = {mix([](const LocalLight &l) { return l.slant.x; }),
                   mix([](const LocalLight &l) { return l.slant.y; })};
    return light;
}

// A pixel of one smooth surface: what its middle ray meets, and how its rays spread there.
struct Spread {
    const Object *object;
    Vec3 middle;     // in the object's frame
    Vec3 direction;  // of the ray, not of length 1
    Vec3 normal;
    double slant;    // sine of the angle between ray and surface
    double filter2;  // mm^2, square to the ray: of pixel and pupil
    double spot_mm;
    const LocalLight *light;
    int tone;
    const Pose *object_camera;
    double z;
};

double reflected(const Spread &s, const Vec3 &p, double rms_mm, double edge_mm, int channel) {
    SurfacePlace place;
    place.p = p;
    place.met = s.middle;
    place.n = s.normal;
    place.tone = s.tone;
    place.rms_mm = rms_mm;
    place.edge_mm = edge_mm;
    place.spot_mm = s.spot_mm;
    place.slant = s.light->slant;
    if (s.object->solid == nullptr) {
        place.on_sheet = true;
        place.sheet = s.object->sheet.place(p);
    }
    return std::max(reflectance(s.object->material, place, channel), 0.0);
}

// Textures of noise, through a filter that is as long as the slant makes it: up to three round ones
// in a row, whose second moment is that of the whole.
double filtered_along(const Spread &s, int channel) {
    const double least = s.object->solid == nullptr ? 0.12 : 0.3;
    const double across = std::sqrt(s.filter2 + s.spot_mm * s.spot_mm);
    const double along = across / std::max(s.slant, least);
    const int count = along < 1.4 * across ? 1 : along < 2.5 * across ? 2 : 3;
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

// Textures with edges: two rays through opposite places of pixel and pupil. Slopes cancel between
// them, so that their mean is much better than their difference says.
double filtered_in_two(const Spread &s, const View &view, const PixelTask &task, Vec2 &pair) {
    const std::uint64_t key = task.key;
    const PixelView &pixel = task.views[0];
    const auto share = [key](unsigned shift) {
        return static_cast<unsigned>(key >> shift) & 0xFFFFu;
    };
    const Vec2 offset = {view.pixel_alone->offset(share(0)), view.pixel_alone->offset(share(16))};
    const Vec2 pupil = disk(centred(share(32)), centred(share(48)));
    const Segment ray = segment(pixel, offset, pupil);
    const Segment middle = segment(pixel, {}, {});
    const Vec2 lens = ray.pupil_mm - middle.pupil_mm;
    const Vec2 slopes = ray.slopes - middle.slopes;
    // On the tangent plane.
    const Vec3 aside =
        s.object_camera->rotation * Vec3{lens.x + s.z * slopes.x, lens.y + s.z * slopes.y, 0};
    const Vec3 on_plane = aside - (dot(s.normal, aside) / dot(s.normal, s.direction)) * s.direction;
    const double filter2 = kFiltered * s.filter2;
    const double rms = std::sqrt((filter2 + s.spot_mm * s.spot_mm) / std::max(s.slant, 0.05));
    const double edge = std::sqrt(filter2);
    pair = {reflected(s, s.middle + kPull * on_plane, rms, edge, task.channel),
            reflected(s, s.middle - kPull * on_plane, rms, edge, task.channel)};
    return 0.5 * (pair.x + pair.y);
}

bool has_edges(const Material &material) {
    return material.kind == MaterialKind::kBoard || material.kind == MaterialKind::kPainted;
}

// Ornaments more out of focus than this begin with 16 rays: the filters of fewer are of another
// shape than the blur, and neighbours that end after different numbers of rays differ: grain.
constexpr double kBlurredPx = 2;

// Mean luminance of a pixel whose rays all meet one smooth surface, from its middle ray. False:
// the texture asks for more rays, from level `next` on.
bool smooth_luminance(const View &view, const PixelTask &task, Remembered &memory,
                      double &luminance, int &next) {
    const PixelView &pixel = task.views[0];
    const Segment middle = segment(pixel, {}, {});
    Found found;
    for (const Candidate &candidate : *task.candidates) {
        if (candidate.z_near >= found.z) {
            break;
        }
        meet(candidate, middle, task.z_from, found);
    }
    if (found.candidate == nullptr) {
        luminance = view.scene->ambient.channel[task.channel];
        return true;
    }
    const double blur_mm = pixel.pupil_radius_mm * std::fabs(1 - found.z / pixel.focus_mm);
    const double pixel_mm = pixel.pixel_slope * found.z;
    Spread s{};
    LocalLight light;
    s.object = found.candidate->object;
    if (task.block_light != nullptr) {
        light = between(*task.block_light, task.block_place.x, task.block_place.y, task.channel);
        s.light = &light;
        s.normal = s.object->sheet.normal(found.p);
    } else {
        remember(view, found, blur_mm + pixel_mm, memory);
        s.light = &memory.light;
        s.normal = memory.normal;
        s.tone = memory.tone;
    }
    s.middle = found.p;
    s.direction = found.direction;
    s.slant = std::fabs(dot(s.normal, found.direction)) / length(found.direction);
    s.filter2 = view.pixel_alone->variance(kWhole) * pixel_mm * pixel_mm +
                kDiskVariance[0] * blur_mm * blur_mm;
    s.spot_mm = view.spot_px * pixel_mm;
    s.object_camera = &found.candidate->object_camera;
    s.z = found.z;
    const double lit = (1 / kPi) * s.light->lux[task.channel];
    const double sheen = s.light->sheen[task.channel];
    if (!has_edges(s.object->material)) {
        luminance = lit * filtered_along(s, task.channel) + sheen;
        return true;
    }
    if (s.object->material.kind == MaterialKind::kPainted && blur_mm > kBlurredPx * pixel_mm) {
        next = 1;
        return false;
    }
    Vec2 pair;
    luminance = lit * filtered_in_two(s, view, task, pair) + sheen;
    const double k = task.electrons_per_luminance;
    const double difference = lit * (pair.x - pair.y) * k;
    return 0.1 * difference * difference <= kErrorPart2 * (luminance * k + task.least_noise_e2);
}

Course stratified_course(const View &view, const PixelTask &task, int n, int level) {
    const SobolPoint &point = sobol_points()[static_cast<std::size_t>(n % kMostSamples)];
    const std::uint64_t key = n < kMostSamples ? task.key : mixed(task.key);
    const unsigned px = (point[0] ^ key) & 0xFFFFu;
    const unsigned py = (point[1] ^ (key >> 16)) & 0xFFFFu;
    const unsigned lu = (point[2] ^ (key >> 32)) & 0xFFFFu;
    const unsigned lv = (point[3] ^ (key >> 48)) & 0xFFFFu;
    const int moment = task.view_count > 1 ? n % task.view_count : 0;
    const PixelView &pixel = task.views[moment];
    const Aperture &aperture = task.starts_smooth ? *view.pixel_alone : *view.with_spot;
    const unsigned drop = 15U - static_cast<unsigned>(level);
    const double share = 1.0 / (1 << level);
    return {
        segment(pixel, {aperture.offset(px), aperture.offset(py)}, disk(centred(lu), centred(lv))),
        segment(pixel, {aperture.middle(level, px >> drop), aperture.middle(level, py >> drop)},
                disk(((lu >> drop) + 0.5) * share - 1, ((lv >> drop) + 0.5) * share - 1)),
        &aperture,
        task.starts_smooth ? view.spot_px : 0,
        &pixel,
        task.view_candidates != nullptr ? task.view_candidates[moment] : task.candidates,
        level};
}

// Is the mean of n stratified rays as good as the pixel's own noise asks for?
bool settled(const PixelTask &task, double sum, double square, int n, int level) {
    const double mean = sum / n;
    const double variance = std::max(square / n - mean * mean, 0.0) / (n - 1);
    // Only what varies within the shares is error, and the finer they are the less that is; of
    // textures it is little, because they are filtered and pulled (measured: see the tests).
    const double within = (task.starts_smooth ? 0.01 : 0.25) / (level + 1);
    const double k = task.electrons_per_luminance;
    return within * variance * k * k <= kErrorPart2 * (mean * k + task.least_noise_e2);
}

}  // namespace

LocalLight light_on_sheet(const View &view, const PixelView &pixel, const Candidate &candidate) {
    Found found;
    meet(candidate, segment(pixel, {}, {}), 0, found);
    Remembered memory;
    remember(view, found, 0, memory);
    return memory.light;
}

Corner corner_at(const PixelView &pixel, Vec2 offset_px, Vec2 pupil,
                 const std::vector<Candidate> &candidates) {
    Found found;
    const Segment ray = segment(pixel, offset_px, pupil);
    for (const Candidate &candidate : candidates) {
        if (candidate.z_near >= found.z) {
            break;
        }
        meet(candidate, ray, 0, found);
    }
    Corner corner;
    if (found.candidate != nullptr) {
        corner.object = found.candidate->object;
        corner.z = found.z;
        if (corner.object->solid != nullptr && corner.object->material.tones.size() > 1) {
            const Solid &solid = *corner.object->solid;
            corner.tone = solid.nearest_part(found.p, found.candidate->parts).tone;
            corner.normal = solid.normal(found.p, found.candidate->parts);
        }
    }
    return corner;
}

double pixel_luminance(const View &view, const PixelTask &task) {
    Remembered memory;
    double sum = 0;
    double square = 0;
    int n = 0;
    double luminance = 0;
    int next = 0;
    if (task.starts_smooth && smooth_luminance(view, task, memory, luminance, next)) {
        return luminance;
    }
    // Where objects meet, rays that all miss the smaller share must not end the pixel: that would
    // make blurred outlines too sharp. Half of the last level's rays at least, whatever they say.
    const int first_level = task.view_count > 1 || !task.starts_smooth ? 1 : next;
    const bool edge_may_be_near = task.view_count == 1 && !task.starts_smooth;
    const auto add = [&](int level) {
        const double value =
            luminance_along(view, stratified_course(view, task, n, level), task.channel, memory);
        sum += value;
        square += value * value;
        n++;
    };
    for (int level = first_level; level <= kLastLevel; level++) {
        const int count = 4 << (2 * level);
        while (n < count) {
            // Not of textures: half of the shares are left out then, which no spread tells.
            if (edge_may_be_near && level == kLastLevel && n == count / 2 &&
                settled(task, sum, square, n, level)) {
                return sum / n;
            }
            add(level);
        }
        const bool may_end = level == kLastLevel || !edge_may_be_near || memory.one_surface();
        if (may_end && settled(task, sum, square, n, level)) {
            return sum / n;
        }
    }
    // Bright against dark: the same number once more, turned.
    while (n < 2 * kMostSamples) {
        add(kLastLevel);
    }
    return sum / n;
}

}  // namespace world
