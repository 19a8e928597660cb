// SPDX-License-Identifier: Apache-2.0
/// A synthetic pair of two verged, distorted cameras, and its whole reconstruction.
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

/// Two different lenses, four degrees of vergence, a small rotation about every other axis.
struct Verged {
    Rig rig;
    calibration calib;
    Scene scene;
    std::vector<uint16_t> left, right;
};

/// A slanted wall with a ball and a block in front of it, all between 0.8 m and 1.2 m of a stated
/// range of 0.75 m to 1.4 m.
Verged make_verged(uint64_t seed, double noise_grey = 1);

/// A run with everything that it needs.
struct VergedRun {
    std::unique_ptr<Memory> memory;
    std::vector<uint16_t> raw[2];
    reconstruct_result result{};
    int status = -99;
    size_t need_bytes = 0, peak_bytes = 0;
    size_t result_need_bytes = 0, result_bytes = 0;
};

struct VergedSetting {
    reconstruct_options options = reconstruct_default_options();
    reconstruct_environment environment{};
    raw_layout layout = RAW_GREY;
    size_t memory_bytes = 0;  // 0: the result of reconstruct_needs
};

/// Plans and reconstructs; the caller checks `status`.
VergedRun run_verged(const Verged &setup, const VergedSetting &setting = {});

}  // namespace synthetic

#endif
