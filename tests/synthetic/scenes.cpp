// SPDX-License-Identifier: Apache-2.0
#include "synthetic/scenes.hpp"

#include <stdexcept>

namespace synthetic {

double Builder::depth_mm(double disparity_px) const {
    const double above_infinity = disparity_px - (rig_.left.cx - rig_.right.cx);
    if (above_infinity <= 0) {
        throw std::invalid_argument("disparity beyond infinity");
    }
    return rig_.left.fx * rig_.right.centre_mm.x / above_infinity;
}

Texture Builder::noise(double disparity_px, double cell_px, double contrast, double coarse_share) {
    Texture texture;
    texture.contrast = contrast;
    texture.cell_mm = cell_px * depth_mm(disparity_px) / rig_.left.fx;
    texture.coarse_share = coarse_share;
    texture.noise = std::make_shared<const Noise>(random_.bits());
    return texture;
}

Texture Builder::stripes(double disparity_px, double period_px, double contrast) const {
    Texture texture;
    texture.kind = Texture::Kind::Stripes;
    texture.contrast = contrast;
    texture.cell_mm = period_px * depth_mm(disparity_px) / rig_.left.fx;
    return texture;
}

Texture Builder::constant(double mean) {
    Texture texture;
    texture.kind = Texture::Kind::Constant;
    texture.mean = mean;
    return texture;
}

Surface Builder::plane(double at_centre_px, double slope_x, double slope_y,
                       const Texture &texture) const {
    // Disparity is linear in the image where 1/z is linear in the viewing direction.
    const double baseline_mm = rig_.right.centre_mm.x;
    Surface surface;
    surface.normal = {slope_x / baseline_mm, slope_y / baseline_mm, 1 / depth_mm(at_centre_px)};
    surface.texture = texture;
    return surface;
}

Rectangle Builder::window(double disparity_px, double x, double y, double width,
                          double height) const {
    const double mm_per_px = depth_mm(disparity_px) / rig_.left.fx;
    const double left = (x - 0.5 - rig_.left.cx) * mm_per_px;
    const double top = (y - 0.5 - rig_.left.cy) * mm_per_px;
    return {left, left + width * mm_per_px, top, top + height * mm_per_px};
}

Surface Builder::piece(double disparity_px, double x, double y, double width, double height,
                       const Texture &texture) const {
    Surface surface = plane(disparity_px, 0, 0, texture);
    surface.bounds = window(disparity_px, x, y, width, height);
    return surface;
}

Surface Builder::sphere(double disparity_px, double x, double y, double radius_px,
                        const Texture &texture) const {
    const double z = depth_mm(disparity_px);
    Surface surface;
    surface.kind = Surface::Kind::Sphere;
    surface.radius_mm = radius_px * z / rig_.left.fx;
    // The nearest point is on the ray through (x, y); the centre is one radius behind it in z.
    surface.centre = {(x - rig_.left.cx) * z / rig_.left.fx, (y - rig_.left.cy) * z / rig_.left.fy,
                      z + surface.radius_mm};
    surface.texture = texture;
    return surface;
}

Scene everything(const Rig &rig, double nearest_px, const Look &look, uint64_t seed) {
    Builder builder(rig, seed);
    const double w = rig.left.width;
    const double h = rig.left.height;
    const auto noise = [&](double disparity) {
        return builder.noise(disparity, look.cell_px, look.contrast);
    };
    Scene scene;
    const double wall = nearest_px - 25;
    scene.surfaces.push_back(builder.plane(wall, 2.0 / w, -3.0 / h, noise(wall)));
    const double board = nearest_px - 16.3;
    Surface slanted = builder.plane(board, 6.0 / w, 3.0 / h, noise(board));
    slanted.bounds = builder.window(board, 0.10 * w, 0.12 * h, 0.36 * w, 0.40 * h);
    slanted.holes = {builder.window(board, 0.22 * w, 0.24 * h, 0.10 * w, 0.14 * h)};
    scene.surfaces.push_back(slanted);
    const double ball = nearest_px - 8.6;
    scene.surfaces.push_back(builder.sphere(ball, 0.72 * w, 0.34 * h, 0.2 * h, noise(ball)));
    const double block = nearest_px - 5.25;
    scene.surfaces.push_back(
        builder.piece(block, 0.2 * w, 0.62 * h, 0.28 * w, 0.26 * h, noise(block)));
    for (int i = 0; i < 3; i++) {
        const double bar = nearest_px - 2.4 - 5 * i;
        scene.surfaces.push_back(
            builder.piece(bar, (0.6 + 0.11 * i) * w, 0.6 * h, 4 + 2 * i, 0.36 * h, noise(bar)));
    }
    return scene;
}

Scene wall(const Rig &rig, double at_centre_px, double slope_x, double slope_y, const Look &look,
           uint64_t seed) {
    // Another random stream than a caller's own builder: its surfaces must not look alike.
    Builder builder(rig, ~seed);
    Scene scene;
    scene.surfaces.push_back(builder.plane(
        at_centre_px, slope_x, slope_y, builder.noise(at_centre_px, look.cell_px, look.contrast)));
    return scene;
}

Scene step(const Rig &rig, double near_px, double far_px, const Look &look, uint64_t seed) {
    Builder builder(rig, seed);
    const double w = rig.left.width;
    const double h = rig.left.height;
    Scene scene;
    scene.surfaces.push_back(
        builder.plane(far_px, 0, 0, builder.noise(far_px, look.cell_px, look.contrast)));
    scene.surfaces.push_back(builder.piece(near_px, 0.35 * w, 0.25 * h, 0.35 * w, 0.5 * h,
                                           builder.noise(near_px, look.cell_px, look.contrast)));
    return scene;
}

}  // namespace synthetic
