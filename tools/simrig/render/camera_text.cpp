// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "tools/simrig/render/picture.hpp"

namespace world {

std::string camera_text(const Truth &truth) {
    const Camera &camera = truth.camera(truth.rows / 2);
    const Optics &optics = camera.optics;
    const Mat3 &turn = camera.world_camera.rotation;
    const Vec3 &pupil_mm = camera.world_camera.translation_mm;
    const Window &window = truth.window;
    char text[1800];
    std::snprintf(
        text, sizeof text,
        "focal_length_px: %.12g\nfocal_length_mm: %.9g\ncentre_px: [%.12g, %.12g]\n"
        "radial: [%.12g, %.12g, %.12g]\ndecentring: [%.12g, %.12g]\n"
        "pupil_mm: [%.12g, %.12g, %.12g]\n"
        "rotation_world_camera: [%.16g, %.16g, %.16g, %.16g, %.16g, %.16g, %.16g, %.16g, %.16g]\n"
        "focus_distance_mm: %.9g\nf_number: %.9g\npupil_diameter_mm: %.9g\n"
        "size_px: [%d, %d]\nfirst_px: [%d, %d]\nskip: [%d, %d]\nbin: [%d, %d]\n"
        "mirrored: [%d, %d]\n",
        optics.focal_px, optics.focal_length_mm, optics.centre_px.x, optics.centre_px.y,
        optics.radial[0], optics.radial[1], optics.radial[2], optics.decentring.x,
        optics.decentring.y, pupil_mm.x, pupil_mm.y, pupil_mm.z, turn.row0.x, turn.row0.y,
        turn.row0.z, turn.row1.x, turn.row1.y, turn.row1.z, turn.row2.x, turn.row2.y, turn.row2.z,
        optics.focus_distance_mm, optics.f_number, optics.pupil_diameter_mm, truth.columns,
        truth.rows, window.column, window.row, window.skip_x, window.skip_y, window.bin_x,
        window.bin_y, int(truth.mirrored_x), int(truth.mirrored_y));
    std::string objects;
    for (const std::string &name : truth.objects) {
        objects += (objects.empty() ? "\"" : ", \"") + name + "\"";
    }
    return text + ("objects: [" + objects + "]\n");
}

}  // namespace world
