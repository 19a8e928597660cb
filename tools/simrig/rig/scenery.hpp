// SPDX-License-Identifier: Apache-2.0
/// From what a sensor reads to what the world shows it: windows, skipping and time of its frames.
#ifndef VERGENCE_SIMRIG_RIG_SCENERY_HPP
#define VERGENCE_SIMRIG_RIG_SCENERY_HPP

#include <memory>
#include <string>

#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/world/frame.hpp"

namespace simrig {

/// A scene with the rig that looks at it.
class Stage {
  public:
    /// Throws world::BadFile.
    Stage(const std::string &scene, const std::string &rig, uint64_t seed, int threads);
    Stage(std::shared_ptr<world::Scene> scene, const std::string &rig, uint64_t seed, int threads);

    /// Another scene from the next frame on.
    void set_scene(std::shared_ptr<world::Scene> scene);

    /// Numbers of a frame, as Scenery wants them. Where the window leaves the lit array, dark ones.
    std::vector<uint16_t> picture(int camera, const SensorFrame &frame, double begin_us,
                                  const std::function<CameraState(double time_us)> &state);
    /// Truth for the frame that picture() last made for this camera; nothing before.
    bool truth(int camera, world::Truth &truth) const;

    const world::Rig &rig() const { return rig_; }
    const world::Scene &scene() const { return *scene_; }
    static world::Mechanics mechanics(const CameraState &state);

  private:
    struct Asked {
        bool ready = false;
        world::FrameRequest request;
        std::shared_ptr<world::Scene> scene;
    };

    world::Rig rig_;
    std::shared_ptr<world::Scene> scene_;
    uint64_t seed_;
    int threads_;
    std::array<Asked, BRIDGE_CAMERAS> asked_;
};

}  // namespace simrig

#endif
