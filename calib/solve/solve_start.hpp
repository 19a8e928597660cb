// SPDX-License-Identifier: Apache-2.0
/// Finds a solution close enough for the full adjustment: each camera separately, then the rig by a
/// vote, then both together, all with a robust loss.
#ifndef VERGENCE_CALIB_SOLVE_SOLVE_START_HPP
#define VERGENCE_CALIB_SOLVE_SOLVE_START_HPP

#include <string>

#include "calib/bundle/bundle.hpp"
#include "calib/solve/robust.hpp"

namespace calib {

/// Whether the lenses are taken as equidistant from the start.
enum class wide_start { NEVER, IF_BETTER, ALWAYS };

struct start_options {
    int threads = 1;
    wide_start wide = wide_start::NEVER;
    /// Each camera begins at its scanned focal length times this; other than 1 for a second start.
    double focal_factor[CAMERAS] = {1, 1};
    bundle_options robust;       // the final parameters; the loss scale is set from the data
    bundle_options robust_wide;  // those of equidistant lenses
};

/// Finds a state from the used views of `data`. Pairs that contradict the vote are set aside
/// (`used` of both views cleared) until they are judged. The kind of the state's lenses says
/// whether they were found equidistant: where the field is wide or boards look bent, and that kind
/// explains the corners at least twice as well. Returns "" or why there is no start.
std::string find_start(bundle *data, const view_records &records, const start_options &options,
                       bundle_state *state);

/// `adjust` with Cauchy's loss at three times the current robust scale, boards flipped where their
/// second pose is better, repeated until nothing changes.
void adjust_robustly(const bundle &data, bundle_options options, bundle_state *state);

}  // namespace calib

#endif
