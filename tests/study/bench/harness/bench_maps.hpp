// SPDX-License-Identifier: Apache-2.0
/// The maps of a run as files, for analyses in other programs.
#ifndef VERGENCE_TESTS_BENCH_BENCH_MAPS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_MAPS_HPP

#include <string>
#include <vector>

#include "bench/harness/bench_run.hpp"

/// Writes FOLDER/PAIR/NAME.npy, arrays of height x width for numpy.load(): left and right (the grey
/// images that are matched), truth, mask and region if the pair has them; then for each method its
/// map (NaN where rejected) and, of ours, METHOD.guess (rejected pixels too), METHOD.reason,
/// METHOD.confidence and, after refinement, METHOD.sigma. Blanks in a method's name become "_".
/// Throws when a file cannot be written.
void bench_write_maps(const std::string &folder, const bench_pair &pair,
                      const std::vector<bench_outcome> &outcomes);

#endif
