// SPDX-License-Identifier: Apache-2.0
/// What the tests of the world share: temporary files, rigs with some errors, still cameras.
#ifndef VERGENCE_TESTS_SIMRIG_WORLD_HARNESS_HPP
#define VERGENCE_TESTS_SIMRIG_WORLD_HARNESS_HPP

#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "tools/simrig/render/frame.hpp"

namespace world_harness {

inline std::string file(const std::string &name) {
    return std::string(SIMRIG_FILES) + "/" + name;
}

/// A file that is removed with this object.
class ShortLivedFile {
  public:
    explicit ShortLivedFile(const std::string &text) {
        char name[] = "/tmp/simrig_try_XXXXXX";
        const int handle = mkstemp(name);
        close(handle);
        path_ = name;
        std::ofstream(path_) << text;
    }
    ~ShortLivedFile() { std::remove(path_.c_str()); }
    ShortLivedFile(const ShortLivedFile &) = delete;
    ShortLivedFile &operator=(const ShortLivedFile &) = delete;
    const std::string &path() const { return path_; }

  private:
    std::string path_;
};

inline world::Scene scene_of(const std::string &text) {
    return world::load_scene(ShortLivedFile(text).path());
}

/// Even light from everywhere, no lamp: a surface of reflectance 1 has luminance 300.
inline std::string even_light() {
    return "room: {origin_mm: [0, 0, 1800], tilt_deg: 0}\n"
           "lights: []\n"
           "ambient: [300, 300, 300]\n"
           "floor_ambient: [300, 300, 300]\n"
           "bounce_lux: 0\n";
}

inline world::Rig perfect_rig() {
    return world::load_rig(file("rigs/perfect.yaml"));
}

inline world::FrameRequest steady(const world::Mechanics &mechanics) {
    world::FrameRequest request;
    request.mechanics = [mechanics](double) { return mechanics; };
    return request;
}

/// Looks along z, focused at a distance.
inline world::Mechanics straight(const world::Rig &rig, double zoom, double focus_mm, double iris) {
    world::Mechanics mechanics;
    mechanics.zoom = zoom;
    mechanics.focus = world::focus_position_for(rig.camera[0].lens, zoom, focus_mm);
    mechanics.iris = iris;
    return mechanics;
}

}  // namespace world_harness

#endif
