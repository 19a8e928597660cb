// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/render/sampler.hpp"

#include <algorithm>

#include "tools/simrig/render/ray.hpp"
#include "tools/simrig/render/smooth.hpp"

namespace world {

namespace {

// Levels 0, 1, 2 have 4, 16, 64 rays. The filters of 4 are of another shape than pixel and blur.
constexpr int kFirstLevel = 1, kLastLevel = 2;

// Where one ray runs within pixel and pupil, and the middle of its share of them.
struct Course {
    Segment ray;
    Segment middle;
    const Aperture *aperture;
    double spot_px;  // the lens's spot, where the aperture leaves it to the textures' filter
    const PixelView *pixel;
    const std::vector<Candidate> *candidates;
    int level;
};

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
    const double filter2 = kFiltered * (course.aperture->variance(level) * pixel_mm * pixel_mm +
                                        disk_variance(level) * blur_mm * blur_mm);
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
    place.texture = view.texture;
    if (object.solid == nullptr) {
        place.on_sheet = true;
        place.sheet = object.sheet.place(place.p);
    }
    return (1 / kPi) * memory.light.lux[channel] *
               std::max(reflectance(object.material, place, channel), 0.0) +
           memory.light.sheen[channel];
}

double luminance_along(const View &view, const Course &course, int channel, Remembered &memory) {
    const Found found = first_met(*course.candidates, course.ray, 0);
    if (found.candidate == nullptr) {
        memory.one_object = false;
        return view.scene->ambient.channel[channel];
    }
    return shaded(view, course, found, channel, memory);
}

// The n-th ray, at one of the moments.
Course stratified_course(const View &view, const PixelTask &task, int n, int level,
                         std::size_t of_moments) {
    const RayPoint &point = ray_points()[static_cast<std::size_t>(n % kMaxSamples)];
    // The same places again, rotated.
    const std::uint64_t key =
        n < kMaxSamples ? task.key
                        : mixed(task.key + static_cast<std::uint64_t>(n / kMaxSamples - 1));
    const unsigned px = (point[0] ^ key) & 0xFFFFu;
    const unsigned py = (point[1] ^ (key >> 16)) & 0xFFFFu;
    const unsigned lu = (point[2] ^ (key >> 32)) & 0xFFFFu;
    const unsigned lv = (point[3] ^ (key >> 48)) & 0xFFFFu;
    const PixelMoment &moment = (*task.moments)[of_moments];
    const PixelView &pixel = moment.view;
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
        moment.candidates,
        level};
}

// Whether the mean of n stratified rays is as accurate as the pixel's own noise requires.
bool settled(const PixelTask &task, double sum, double square, int n, int level) {
    const double mean = sum / n;
    const double variance = std::max(square / n - mean * mean, 0.0) / (n - 1);
    // Only what varies within the shares is error, and the finer they are the less that is; of
    // textures it is little, because they are filtered and pulled (measured: see the tests).
    const double within = (task.starts_smooth ? 0.01 : 0.25) / (level + 1);
    const double k = task.electrons_per_luminance;
    return within * variance * k * k <= kErrorPart2 * (mean * k + task.min_noise_e2);
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
    const Found found = first_met(candidates, segment(pixel, offset_px, pupil), 0);
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

namespace {

// The rays of one pixel so far.
struct Rays {
    const View &view;
    const PixelTask &task;
    Remembered memory;
    double sum = 0;
    double square = 0;
    int n = 0;

    void add_until(int count, int level) {
        for (; n < count; n++) {
            const std::size_t moment = static_cast<std::size_t>(n) % task.moments->size();
            const double value = luminance_along(
                view, stratified_course(view, task, n, level, moment), task.channel, memory);
            sum += value;
            square += value * value;
        }
    }
    bool are_enough(int level) const { return settled(task, sum, square, n, level); }
    double mean() const { return sum / n; }
};

// As many rays as the pixel's noise asks for.
double traced_luminance(const PixelTask &task, Rays &rays) {
    // Where objects meet, rays that all miss the smaller share must not end the pixel: that would
    // make blurred outlines too sharp. Use at least half of the last level's rays.
    const bool edge_may_be_near = task.moments->size() == 1 && !task.starts_smooth;
    for (int level = kFirstLevel; level <= kLastLevel; level++) {
        const int count = 4 << (2 * level);
        if (edge_may_be_near && level == kLastLevel) {
            // Not for textures: half of the shares are left out then, which the spread does not
            // show.
            rays.add_until(count / 2, level);
            if (rays.are_enough(level)) {
                return rays.mean();
            }
        }
        rays.add_until(count, level);
        const bool may_end = level == kLastLevel || !edge_may_be_near || rays.memory.one_surface();
        if (may_end && rays.are_enough(level)) {
            return rays.mean();
        }
    }
    // Bright against dark: the same number again, rotated.
    rays.add_until(2 * kMaxSamples, kLastLevel);
    return rays.mean();
}

// The mean of all moments. False: there may be an edge, or one of them asks for more rays.
bool smooth_throughout(const View &view, const PixelTask &task, Remembered &memory,
                       double &luminance) {
    double sum = 0;
    if (!task.starts_smooth) {
        return false;
    }
    for (const PixelMoment &moment : *task.moments) {
        double one = 0;
        if (!smooth_luminance(view, task, moment, memory, one)) {
            return false;
        }
        sum += one;
    }
    luminance = sum / static_cast<double>(task.moments->size());
    return true;
}

}  // namespace

Colour area_luminance(const View &view, const PixelTask &task, int rays) {
    Remembered memory;
    Colour sum;
    const auto count = static_cast<std::size_t>(rays);
    for (int n = 0; n < rays; n++) {
        // Successive rays are spread well over pixel and pupil: each moment has some of those.
        const std::size_t moment = static_cast<std::size_t>(n) * task.moments->size() / count;
        const Course course = stratified_course(view, task, n, kLastLevel, moment);
        const Found found = first_met(*course.candidates, course.ray, 0);
        for (int c = 0; c < 3; c++) {
            const double luminance = found.candidate == nullptr
                                         ? view.scene->ambient.channel[c]
                                         : shaded(view, course, found, c, memory);
            sum.channel[c] += luminance / rays;
        }
    }
    return sum;
}

bool smooth_pixel_luminance(const View &view, const PixelTask &task, double &luminance) {
    Remembered memory;
    return smooth_throughout(view, task, memory, luminance);
}

double pixel_luminance(const View &view, const PixelTask &task) {
    Rays rays{view, task, {}};
    double luminance = 0;
    return smooth_throughout(view, task, rays.memory, luminance) ? luminance
                                                                 : traced_luminance(task, rays);
}

Aperture::Aperture(double spot_rms_px) {
    // The distribution's integral on a fine grid, then its inverse.
    constexpr int kCells = 8192;
    const double reach = 0.5 + 3.5 * spot_rms_px;
    std::vector<double> integral(kCells + 1, 0.0);
    for (int i = 0; i < kCells; i++) {
        const double x = reach * ((2.0 * i + 1) / kCells - 1);
        double density = std::fabs(x) <= 0.5 ? 1 : 0;
        if (spot_rms_px > 0) {
            const double scale = 1 / (spot_rms_px * std::sqrt(2.0));
            density = 0.5 * (std::erf((x + 0.5) * scale) - std::erf((x - 0.5) * scale));
        }
        integral[static_cast<std::size_t>(i) + 1] = integral[static_cast<std::size_t>(i)] + density;
    }
    std::size_t cell = 0;
    for (std::size_t n = 0; n < quantile_.size(); n++) {
        const double share = (static_cast<double>(n) + 0.5) /
                             static_cast<double>(quantile_.size()) * integral[kCells];
        while (integral[cell + 1] < share) {
            cell++;
        }
        const double part = (share - integral[cell]) / (integral[cell + 1] - integral[cell]);
        quantile_[n] = reach * (2 * (static_cast<double>(cell) + part) / kCells - 1);
    }
    for (std::size_t level = 0; level < 4; level++) {
        const std::size_t strata = std::size_t{1} << level;
        const std::size_t width = quantile_.size() / strata;
        variance_[level] = 0;
        for (std::size_t s = 0; s < strata; s++) {
            double mean = 0;
            double square = 0;
            for (std::size_t n = s * width; n < (s + 1) * width; n++) {
                mean += quantile_[n];
                square += quantile_[n] * quantile_[n];
            }
            mean /= static_cast<double>(width);
            middle_[level][s] = mean;
            variance_[level] +=
                (square / static_cast<double>(width) - mean * mean) / static_cast<double>(strata);
        }
    }
}

PixelView pixel_view(const Camera &camera, Vec2 pixel, Vec2 guess) {
    PixelView view;
    view.slopes = camera.slopes_of(pixel, guess, view.step);
    view.pixel_slope = std::fabs(view.step[0]);
    view.pupil_radius_mm = 0.5 * camera.optics.pupil_diameter_mm;
    view.focus_mm = camera.optics.focus_distance_mm;
    return view;
}

}  // namespace world
