// SPDX-License-Identifier: Apache-2.0
/// A synthetic pair of two verged, distorted cameras, and the whole reconstruction of it.
#ifndef VERGENCE_TESTS_SYNTHETIC_VERGED_HPP
#define VERGENCE_TESTS_SYNTHETIC_VERGED_HPP

#include <cstdint>
#include <memory>
#include <vector>

#include "stereo/reconstruct.h"
#include "synthetic/matched.hpp"
#include "synthetic/pair.hpp"

namespace synthetic {

constexpr int kVergedWidth = 320;
constexpr int kVergedHeight = 240;
constexpr int kVergedBits = 10;
constexpr double kVergedFocalPx = 500;
constexpr double kVergedBaselineMm = 100;

/// Two lenses that differ, four degrees of vergence, a little of every other rotation.
struct Verged {
    Rig rig;
    calibration calib;
    Scene scene;
    std::vector<uint16_t> left, right;
};

/// A slanted wall, a ball and a block before it, all between 0.8 m and 1.2 m of a stated range of
/// 0.75 m to 1.4 m.
Verged make_verged(uint64_t seed, double noise_grey = 1);

/// A run with all that keeps it alive.
struct VergedRun {
    std::unique_ptr<Memory> memory;
    reconstruct_result result{};
    int status = -99;
    size_t need_bytes = 0, peak_bytes = 0;
};

struct VergedSetting {
    reconstruct_options options = reconstruct_default_options();
    reconstruct_environment environment{};
    pixel_layout layout = PIXEL_GREY;
    size_t memory_bytes = 0;  // 0: what reconstruct_need_bytes asks for
};

/// Plans and reconstructs; the caller looks at `status`.
VergedRun run_verged(const Verged &setup, const VergedSetting &setting = {});

}  // namespace synthetic

#endif
