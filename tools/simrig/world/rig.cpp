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
    entry.allow({"focal_length_wide_mm",
                 "focal_length_tele_mm",
                 "bow_mm",
                 "ripple_mm",
                 "ripple_periods",
                 "ripple_phase_deg",
                 "centre_offset_px",
                 "centre_wander_px",
                 "pupil_travel_mm",
                 "distortion_wide",
                 "distortion_tele",
                 "decentring_wide_px",
                 "decentring_tele_px",
                 "nearest_focus_mm",
                 "focus_drift_per_m",
                 "breathing",
                 "f_number_wide",
                 "f_number_tele",
                 "f_number_closed",
                 "transmission",
                 "natural_falloff",
                 "mount_falloff",
                 "spot_rms_um"});
    Lens lens;
    lens.focal_length_wide_mm = entry.number("focal_length_wide_mm", 1, 1000);
    lens.focal_length_tele_mm = entry.number("focal_length_tele_mm", 1, 1000);
    lens.bow_mm = entry.number("bow_mm", -5, 5);
    lens.ripple_mm = entry.number("ripple_mm", -1, 1);
    lens.ripple_periods = entry.number("ripple_periods", 0, 50);
    lens.ripple_phase_rad = radians(entry.number("ripple_phase_deg", -360, 360));
    lens.centre_offset_px = pair_of(entry, "centre_offset_px");
    lens.centre_wander_px = pair_of(entry, "centre_wander_px");
    lens.pupil_travel_mm = entry.number("pupil_travel_mm", -200, 200);
    lens.distortion_wide = triple_of(entry, "distortion_wide");
    lens.distortion_tele = triple_of(entry, "distortion_tele");
    lens.decentring_wide_px = pair_of(entry, "decentring_wide_px");
    lens.decentring_tele_px = pair_of(entry, "decentring_tele_px");
    lens.nearest_focus_mm = entry.number("nearest_focus_mm", 100, 100000);
    lens.focus_drift_per_m = entry.number("focus_drift_per_m", -1, 1);
    lens.breathing = entry.number("breathing", -1, 2);
    lens.f_number_wide = entry.number("f_number_wide", 0.7, 64);
    lens.f_number_tele = entry.number("f_number_tele", 0.7, 64);
    lens.f_number_closed = entry.number("f_number_closed", 0.7, 64);
    lens.transmission = entry.number("transmission", 0.01, 1);
    lens.natural_falloff = entry.number("natural_falloff", 0, 1);
    lens.mount_falloff = entry.number("mount_falloff", 0, 0.9);
    lens.spot_rms_um = entry.number("spot_rms_um", 0, 20);
    return lens;
}

Sensor read_sensor(const Entry &entry) {
    entry.allow({"pixel_um", "full_well_e", "read_noise_e", "black_level_dn", "electrons_per_lux_s",
                 "filter_part", "photon_noise", "prnu", "row_noise_e", "serial"});
    Sensor sensor;
    sensor.pixel_um = entry.number("pixel_um", 0.5, 50);
    sensor.full_well_e = entry.number("full_well_e", 100, 1e6);
    sensor.read_noise_e = entry.number("read_noise_e", 0, 1000);
    sensor.black_level_dn = entry.number("black_level_dn", 0, 500);
    sensor.electrons_per_lux_s = entry.number("electrons_per_lux_s", 0, 1e7);
    sensor.filter_part = triple_of(entry, "filter_part");
    sensor.photon_noise = entry.number("photon_noise", 0, 1);
    sensor.prnu = entry.number("prnu", 0, 0.2);
    sensor.row_noise_e = entry.number("row_noise_e", 0, 1000);
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

RigCamera read_camera(const Entry &entry) {
    // rig/settings.cpp reads the last three.
    entry.allow({"pan_deg", "mount", "lens", "sensor", "servo", "motors", "link"});
    RigCamera camera;
    camera.pan_rad = radians(entry.number("pan_deg", -180, 180));
    camera.mount = read_mount(entry.at("mount"));
    camera.lens = read_lens(entry.at("lens"));
    camera.sensor = read_sensor(entry.at("sensor"));
    return camera;
}

}  // namespace

Rig load_rig(const std::string &path) {
    const Entry file = Entry::of_file(path);
    file.allow({"left", "right", "mains", "lens_controller"});
    Rig rig;
    rig.camera[0] = read_camera(file.at("left"));
    rig.camera[1] = read_camera(file.at("right"));
    const Entry mains = file.at("mains");
    mains.allow({"frequency_hz", "modulation", "phase_deg"});
    rig.mains.frequency_hz = mains.number("frequency_hz", 0.1, 10000);
    rig.mains.modulation = mains.number("modulation", 0, 1);
    rig.mains.phase_rad = radians(mains.number("phase_deg", -360, 360));
    return rig;
}

}  // namespace world
