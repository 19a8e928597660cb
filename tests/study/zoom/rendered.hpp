// SPDX-License-Identifier: Apache-2.0
/// Pairs of rendered frames, refined as the board refines them.
#ifndef VERGENCE_TESTS_ZOOM_RENDERED_HPP
#define VERGENCE_TESTS_ZOOM_RENDERED_HPP

#include "tests/study/zoom/trial.hpp"

namespace zoom_study {

struct Rendered {
    Result frames;
    Sample matches, used, noise_px, seconds, refining_seconds;
};

struct RenderedWidePair {
    Result wide, narrow;
    Sample carried, carried_px, seconds;
};

/// The cylinder as both cameras see it at the rig's present state.
struct RenderedPair {
    Moment moment;
    std::vector<uint8_t> grey[2];
};
RenderedPair render_pair(StudyRig &rig, simrig::Noise &noise);

/// Refines a pair and judges what it says.
void try_rendered(const zoom_calibration &calibration, RenderedPair &pair, simrig::Noise &noise,
                  Rendered &result);
/// The same with pairs before and after zooming.
void try_rendered_wide_pair(const zoom_calibration &calibration, RenderedPair &wide,
                            RenderedPair &narrow, simrig::Noise &noise, RenderedWidePair &result);

}  // namespace zoom_study

#endif
