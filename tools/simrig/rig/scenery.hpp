// SPDX-License-Identifier: Apache-2.0
/// Maps a sensor's readout to the world: windows, skipping and times of its frames.
#ifndef VERGENCE_SIMRIG_RIG_SCENERY_HPP
#define VERGENCE_SIMRIG_RIG_SCENERY_HPP

#include <deque>
#include <memory>
#include <string>
#include <utility>

#include "tools/simrig/render/frame.hpp"
#include "tools/simrig/rig/rig.hpp"

namespace simrig {

/// A scene with the rig that looks at it.
class Stage {
  public:
    /// Throws world::BadFile.
    Stage(const std::string &scene, const std::string &rig, uint64_t seed, int threads);
    Stage(std::shared_ptr<world::Scene> scene, const std::string &rig, uint64_t seed, int threads);

    /// Replaces the scene from the next frame on.
    void set_scene(std::shared_ptr<world::Scene> scene);

    /// From begin_us on the scene's light changes linearly to `share` of what its file has, which
    /// it reaches at end_us.
    void set_light(double share, double begin_us, double end_us);
    /// A cap on a lens lets no light in.
    void set_cap(int camera, bool on);

    /// Numbers of a frame, as Scenery wants them. Where the window leaves the lit array, dark ones.
    std::vector<uint16_t> picture(int camera, const SensorFrame &frame, double begin_us,
                                  const std::function<CameraState(double time_us)> &state);
    /// What was last pictured: rows and columns of that frame, and the scene that it shows. Null:
    /// picture() has not made a frame for this camera yet, or none with a lit pixel.
    struct Pictured {
        int columns = 0, rows = 0;
        std::shared_ptr<const world::Scene> scene;
    };
    const Pictured *pictured(int camera) const;
    /// From now on pictured() and truth() are of that frame of the last kRemembered whose begin is
    /// nearest to begin_us, until the next frame.
    void recall(int camera, double begin_us);
    /// Depth of what a part of the whole array sees with these positions, row by row; 0: nothing.
    std::vector<float> depth_mm(int camera, const world::Window &part,
                                const world::Mechanics &mechanics) const;
    /// Truth for `rows` rows from `first_row` on of that frame, in the order of its pixels;
    /// dark pixels see nothing. pictured() must not be null, and the rows must exist.
    world::Truth truth(int camera, int first_row, int rows) const;

    const world::Rig &rig() const { return rig_; }
    const world::Scene &scene() const { return *scene_; }
    static world::Mechanics mechanics(const CameraState &state);

  private:
    // Outputs of an axis that the world shows: from `begin` on, `count`; the others are dark.
    struct Lit {
        int begin = 0, count = 0;
    };
    struct Asked {
        bool ready = false;
        Pictured pictured;
        bool flip_columns = false, flip_rows = false;
        Lit columns, rows;
        world::FrameRequest request;  ///< request for the lit part
    };
    static Lit lit_part(int start, int skip, int bin, int outputs, int array);
    void ask(Asked &asked, const SensorFrame &frame, double begin_us) const;

    world::Rig rig_;
    std::shared_ptr<world::Scene> scene_;
    uint64_t seed_;
    int threads_;
    struct Light {
        double from = 1, to = 1, begin_us = 0, end_us = 0;
        double at(double time_us) const;
    };
    Light light_;
    std::array<bool, BRIDGE_CAMERAS> capped_{};
    std::array<world::StillLight, BRIDGE_CAMERAS> still_{};
    std::array<Asked, BRIDGE_CAMERAS> asked_;
    // Those before and with the last one, by begin: a search of focus or light takes some sixty.
    static constexpr size_t kRemembered = 1000;
    std::array<std::deque<std::pair<double, Asked>>, BRIDGE_CAMERAS> remembered_;
};

}  // namespace simrig

#endif
