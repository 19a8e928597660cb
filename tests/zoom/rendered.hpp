// SPDX-License-Identifier: Apache-2.0
/// Pairs of rendered frames, refined as the board refines them.
#ifndef VERGENCE_TESTS_ZOOM_RENDERED_HPP
#define VERGENCE_TESTS_ZOOM_RENDERED_HPP

#include "tests/zoom/trial.hpp"

namespace zoom_study {

struct Rendered {
    Result frames;
    Sample matches, used, noise_px, seconds, refining_seconds;
};

/// Renders the cylinder at the rig's present state, refines the pair and judges what it says.
void try_rendered(const zoom_calibration &calibration, StudyRig &rig, simrig::Noise &noise,
                  Rendered &result);

}  // namespace zoom_study

#endif
