// SPDX-License-Identifier: Apache-2.0
#include "synthetic/verged.hpp"

#include "core/error.h"
#include "synthetic/scenes.hpp"

namespace synthetic {

namespace {

Camera lens_of(double focal_px, double cx_off, double cy_off, double k1) {
    Camera camera;
    camera.width = kVergedWidth;
    camera.height = kVergedHeight;
    camera.fx = focal_px;
    camera.fy = focal_px * 1.003;
    camera.cx = (kVergedWidth - 1) / 2.0 + cx_off;
    camera.cy = (kVergedHeight - 1) / 2.0 + cy_off;
    camera.k1 = k1;
    camera.k2 = 0.07;
    camera.p1 = 0.0008;
    camera.p2 = -0.0005;
    return camera;
}

// A slanted wall with a ball and a block in front of it, all between 0.8 m and 1.2 m.
Scene verged_scene(uint64_t seed) {
    const Rig guide = rectified_rig(kVergedWidth, kVergedHeight, kVergedFocalPx, kVergedBaselineMm);
    Builder builder(guide, seed);
    const auto noise = [&](double disparity) { return builder.noise(disparity, 3, 0.15); };
    Scene scene;
    scene.surfaces.push_back(builder.plane(44, 0.012, -0.02, noise(44)));
    scene.surfaces.push_back(builder.sphere(58, 205, 95, 50, noise(58)));
    scene.surfaces.push_back(builder.piece(61, 70, 120, 80, 70, noise(61)));
    return scene;
}

}  // namespace

Verged make_verged(uint64_t seed, double noise_grey) {
    const Vector rotation{0.006, -0.07, -0.008};
    const Vector centre{kVergedBaselineMm, 1.5, -2};
    const Vector translation = -1.0 * (rotation_from_vector(rotation) * centre);
    Verged setup;
    setup.rig = posed_rig(lens_of(kVergedFocalPx, 4, -3, -0.16),
                          lens_of(kVergedFocalPx * 1.01, -5, 2, -0.14), rotation, translation);
    setup.calib = calibration_of(setup.rig, rotation, translation);
    setup.calib.depth_near_mm = 750;
    setup.calib.depth_far_mm = 1400;
    setup.scene = verged_scene(seed);
    Sensor sensor;
    sensor.bits = kVergedBits;
    sensor.noise_grey = noise_grey;
    setup.left = render_view(setup.scene, setup.rig.left, sensor, 3, seed);
    sensor.gain = 1.06;
    setup.right = render_view(setup.scene, setup.rig.right, sensor, 3, seed + 1);
    return setup;
}

VergedRun run_verged(const Verged &setup, const VergedSetting &setting) {
    VergedRun run;
    rectify_plan plan;
    run.status = rectify_plan_make(&setup.calib, &setting.options.rectify, &plan);
    if (run.status != ERROR_OK) {
        return run;
    }
    const parallel *workers = setting.environment.parallel;
    const int channels = setting.layout == RAW_RGB ? 3 : 1;
    raw_image image[2];
    for (int side = 0; side < 2; side++) {
        for (const uint16_t value : side == 0 ? setup.left : setup.right) {
            run.raw[side].insert(run.raw[side].end(), static_cast<size_t>(channels), value);
        }
        image[side] = {run.raw[side].data(), kVergedWidth,   kVergedHeight, kVergedWidth * channels,
                       kVergedBits,          setting.layout, nullptr,       nullptr};
    }
    const reconstruct_need need =
        reconstruct_needs(&image[0], &image[1], &setup.calib, &plan, &setting.options,
                          workers != nullptr ? workers->threads : 1);
    run.need_bytes = need.bytes;
    run.result_need_bytes = need.result_bytes;
    run.memory =
        std::make_unique<Memory>(setting.memory_bytes > 0 ? setting.memory_bytes : run.need_bytes);
    arena arena;
    arena_init(&arena, run.memory->data(), run.memory->size());
    run.status = reconstruct_run(&image[0], &image[1], &setup.calib, &plan, &setting.options,
                                 &setting.environment, &arena, &run.result);
    run.peak_bytes = arena.peak_bytes;
    run.result_bytes = arena.used_bytes;
    return run;
}

}  // namespace synthetic
