// SPDX-License-Identifier: Apache-2.0
/// Maps a sensor's readout to the world: windows, skipping and times of its frames.
#ifndef VERGENCE_SIMRIG_RIG_SCENERY_HPP
#define VERGENCE_SIMRIG_RIG_SCENERY_HPP

#include <memory>
#include <string>

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
        world::FrameRequest request;  ///< of the lit part
    };
    static Lit lit_part(int start, int skip, int bin, int outputs, int array);
    void ask(Asked &asked, const SensorFrame &frame, double begin_us) const;

    world::Rig rig_;
    std::shared_ptr<world::Scene> scene_;
    uint64_t seed_;
    int threads_;
    std::array<Asked, BRIDGE_CAMERAS> asked_;
};

}  // namespace simrig

#endif
