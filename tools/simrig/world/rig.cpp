// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/world/rig.hpp"

#include "tools/simrig/world/document.hpp"

namespace world {
namespace {

Vec2 pair_of(const Entry &entry, const std::string &key) {
    return entry.at(key).pair();
}

std::array<double, 3> triple_of(const Entry &entry, const std::string &key) {
    const Vec3 v = entry.at(key).vector();
    return {v.x, v.y, v.z};
}

Vec3 turn_of(const Entry &entry, const std::string &key) {
    const Vec3 v = entry.at(key).vector();
    return {radians(v.x), radians(v.y), radians(v.z)};
}

Lens read_lens(const Entry &entry) {
    Lens lens;
    entry.read({{"focal_length_wide_mm", &lens.focal_length_wide_mm, 1, 1000},
                {"focal_length_tele_mm", &lens.focal_length_tele_mm, 1, 1000},
                {"bow_mm", &lens.bow_mm, -5, 5},
                {"ripple_mm", &lens.ripple_mm, -1, 1},
                {"ripple_periods", &lens.ripple_periods, 0, 50},
                {"pupil_travel_mm", &lens.pupil_travel_mm, -200, 200},
                {"nearest_focus_mm", &lens.nearest_focus_mm, 100, 100000},
                {"focus_drift_per_m", &lens.focus_drift_per_m, -1, 1},
                {"breathing", &lens.breathing, -1, 2},
                {"f_number_wide", &lens.f_number_wide, 0.7, 64},
                {"f_number_tele", &lens.f_number_tele, 0.7, 64},
                {"f_number_closed", &lens.f_number_closed, 0.7, 64},
                {"transmission", &lens.transmission, 0.01, 1},
                {"natural_falloff", &lens.natural_falloff, 0, 1},
                {"mount_falloff", &lens.mount_falloff, 0, 0.9},
                {"spot_rms_um", &lens.spot_rms_um, 0, 20},
                {"diffraction", &lens.diffraction, 0, 10}},
               {"exponential", "centre_irregular_px", "spot_corner_um", "lateral_colour_px",
                "ripple_phase_deg", "centre_offset_px", "centre_wander_px", "distortion_wide",
                "distortion_tele", "decentring_wide_px", "decentring_tele_px"});
    lens.ripple_phase_rad = radians(entry.number("ripple_phase_deg", -360, 360));
    lens.centre_offset_px = pair_of(entry, "centre_offset_px");
    lens.centre_wander_px = pair_of(entry, "centre_wander_px");
    lens.exponential = entry.number("exponential", 0, 1, lens.exponential);
    lens.spot_corner_um = entry.number("spot_corner_um", 0, 20, lens.spot_corner_um);
    if (entry.has("centre_irregular_px")) {
        lens.centre_irregular_px = pair_of(entry, "centre_irregular_px");
    }
    if (entry.has("lateral_colour_px")) {
        lens.lateral_colour_px = pair_of(entry, "lateral_colour_px");
    }
    lens.distortion_wide = triple_of(entry, "distortion_wide");
    lens.distortion_tele = triple_of(entry, "distortion_tele");
    lens.decentring_wide_px = pair_of(entry, "decentring_wide_px");
    lens.decentring_tele_px = pair_of(entry, "decentring_tele_px");
    return lens;
}

Sensor read_sensor(const Entry &entry) {
    Sensor sensor;
    entry.read({{"pixel_um", &sensor.pixel_um, 0.5, 50},
                {"full_well_e", &sensor.full_well_e, 100, 1e6},
                {"read_noise_e", &sensor.read_noise_e, 0, 1000},
                {"black_level_dn", &sensor.black_level_dn, 0, 500},
                {"electrons_per_lux_s", &sensor.electrons_per_lux_s, 0, 1e7},
                {"photon_noise", &sensor.photon_noise, 0, 1},
                {"prnu", &sensor.prnu, 0, 0.2},
                {"row_noise_e", &sensor.row_noise_e, 0, 1000}},
               {"filter_part", "serial"});
    sensor.filter_part = triple_of(entry, "filter_part");
    sensor.serial = static_cast<std::uint64_t>(entry.at("serial").whole(0, 1000000000));
    return sensor;
}

Mount read_mount(const Entry &entry) {
    entry.allow({"pupil_mm", "turn_deg", "axis_point_mm", "axis_direction"});
    Mount mount;
    mount.pupil_mm = entry.at("pupil_mm").vector();
    mount.turn_rad = turn_of(entry, "turn_deg");
    mount.axis_point_mm = entry.at("axis_point_mm").vector();
    const Vec3 direction = entry.at("axis_direction").vector();
    if (length(direction) < 1e-9) {
        entry.at("axis_direction").fail("an axis direction must not be zero");
    }
    mount.axis_direction = unit(direction);
    return mount;
}

Drift read_drift(const Entry &entry) {
    Drift drift;
    entry.read({{"focal_part", &drift.focal_part, -0.1, 0.1}}, {"centre_px", "turn_deg"});
    drift.centre_px = pair_of(entry, "centre_px");
    drift.turn_rad = turn_of(entry, "turn_deg");
    return drift;
}

RigCamera read_camera(const Entry &entry) {
    // rig/settings.cpp reads the last three.
    entry.allow({"pan_deg", "mount", "lens", "sensor", "servo", "motors", "link", "drift"});
    RigCamera camera;
    camera.pan_rad = radians(entry.number("pan_deg", -180, 180));
    camera.mount = read_mount(entry.at("mount"));
    camera.lens = read_lens(entry.at("lens"));
    camera.sensor = read_sensor(entry.at("sensor"));
    if (entry.has("drift")) {
        camera.drift = read_drift(entry.at("drift"));
    }
    return camera;
}

}  // namespace

Rig load_rig(const std::string &path) {
    const Entry file = Entry::of_file(path);
    file.allow({"left", "right", "mains", "lens_controller", "texture", "warm_up_h"});
    Rig rig;
    rig.camera[0] = read_camera(file.at("left"));
    rig.camera[1] = read_camera(file.at("right"));
    const Entry mains = file.at("mains");
    mains.allow({"frequency_hz", "modulation", "phase_deg"});
    rig.mains.frequency_hz = mains.number("frequency_hz", 0.1, 10000);
    rig.mains.modulation = mains.number("modulation", 0, 1);
    rig.mains.phase_rad = radians(mains.number("phase_deg", -360, 360));
    rig.texture = file.number("texture", 0, 1, rig.texture);
    return rig;
}

}  // namespace world
