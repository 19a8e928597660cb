// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <stdexcept>

#include "tools/simrig/render/frame.hpp"
#include "tools/simrig/render/tile.hpp"

namespace world {
namespace {

// Of solids: distance to the surface at which a ray has arrived.
constexpr double kToleranceMm = 1e-7;
constexpr int kTile = 8;

struct Place {
    double z = 1e30;
    const Candidate *candidate = nullptr;
};

Place nearest(const std::vector<Candidate> &candidates, const Vec3 &slopes) {
    Place best;
    for (const Candidate &candidate : candidates) {
        if (candidate.z_near >= best.z) {
            break;
        }
        const Object &object = *candidate.object;
        const double per_z = length(slopes);
        const Ray ray = {candidate.object_camera.translation_mm,
                         (1 / per_z) * (candidate.object_camera.rotation * slopes)};
        const double t =
            object.solid == nullptr
                ? object.sheet.trace(ray)
                : object.solid->trace(ray, candidate.z_near * per_z, candidate.z_far * per_z,
                                      kToleranceMm, candidate.parts);
        if (t > 0 && t / per_z < best.z) {
            best = {t / per_z, &candidate};
        }
    }
    return best;
}

void set_pixel(Truth &truth, std::size_t pixel, const Place &place, const Vec3 &slopes) {
    if (place.candidate == nullptr) {
        return;
    }
    const Object &object = *place.candidate->object;
    const Pose &pose = place.candidate->object_camera;
    const Vec3 p = pose * (place.z * slopes);
    Vec3 normal = object.solid == nullptr ? object.sheet.normal(p)
                                          : object.solid->normal(p, object.solid->every_part());
    if (dot(normal, pose.rotation * slopes) > 0) {
        normal = -normal;
    }
    normal = transposed(pose.rotation) * normal;
    truth.depth_mm[pixel] = static_cast<float>(place.z);
    truth.normal[3 * pixel] = static_cast<float>(normal.x);
    truth.normal[3 * pixel + 1] = static_cast<float>(normal.y);
    truth.normal[3 * pixel + 2] = static_cast<float>(normal.z);
    truth.id[pixel] = static_cast<std::uint8_t>(object.id);
}

void fill_rows(const Scene &scene, const Window &w, int row_begin, int row_end, Camera camera,
               Truth &truth) {
    // Truth is what the pinhole in the pupil's middle sees.
    camera.optics.pupil_diameter_mm = 0;
    std::vector<Pose> object_camera;
    for (const auto &object : scene.objects) {
        object_camera.push_back(object->object_world * camera.world_camera);
    }
    std::vector<Candidate> candidates;
    for (int column = 0; column < truth.columns; column += kTile) {
        const int column_end = std::min(column + kTile, truth.columns);
        const Beam beam =
            beam_of(camera, w.centre(column, row_begin), w.centre(column_end - 1, row_end - 1),
                    2.0 * std::max(w.bin_x, w.bin_y));
        find_candidates(scene, object_camera, beam, candidates);
        for (int y = row_begin; y < row_end; y++) {
            for (int x = column; x < column_end; x++) {
                const Vec2 s = camera.slopes_of(w.centre(x, y), beam.middle);
                const Vec3 slopes = {s.x, s.y, 1};
                set_pixel(truth, static_cast<std::size_t>(y * truth.columns + x),
                          nearest(candidates, slopes), slopes);
            }
        }
    }
}

}  // namespace

Truth truth(const Scene &scene, const Rig &rig, Side side, const FrameRequest &request) {
    const Window &w = request.window;
    if (w.fault() != nullptr) {
        throw std::invalid_argument(w.fault());
    }
    Truth result;
    result.columns = w.output_columns();
    result.rows = w.output_rows();
    result.window = w;
    for (const auto &object : scene.objects) {
        result.objects.push_back(object->name);
    }
    const auto pixels = static_cast<std::size_t>(result.columns * result.rows);
    result.depth_mm.resize(pixels);
    result.normal.resize(3 * pixels);
    result.id.resize(pixels);
    const auto mechanics_of = [&](int row) {
        return request.mechanics(request.start_time_us + row * request.row_time_us +
                                 0.5 * request.exposure_us);
    };
    const Mechanics first = mechanics_of(0);
    bool moving = false;
    for (int row = 1; row < result.rows && !moving; row++) {
        moving = !(mechanics_of(row) == first);
    }
    for (int row = 0; row < (moving ? result.rows : 1); row++) {
        result.cameras.push_back(camera_at(rig.of(side), mechanics_of(row)));
    }
    const int together = moving ? 1 : kTile;
    for (int row = 0; row < result.rows; row += together) {
        fill_rows(scene, w, row, std::min(row + together, result.rows), result.camera(row), result);
    }
    return result;
}

}  // namespace world
