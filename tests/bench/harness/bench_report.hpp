// SPDX-License-Identifier: Apache-2.0
/// The benchmark's results, as tables for people and as JSON for programs.
#ifndef VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP
#define VERGENCE_TESTS_BENCH_BENCH_REPORT_HPP

#include <string>
#include <vector>

#include "bench/harness/bench_run.hpp"
#include "bench/harness/bench_summary.hpp"

/// Names the methods, their settings and the OpenCV versions. `pypi_version` is empty when it is
/// not measured.
void bench_print_methods(const std::vector<bench_method_entry> &methods,
                         const std::string &pypi_version);

/// The results of all methods on one pair.
void bench_print_table(const bench_pair &pair, const std::vector<bench_outcome> &outcomes);

/// Over all pairs: errors, then time and memory.
void bench_print_summaries(const std::vector<bench_summary> &summaries);

/// Everything as one JSON object on standard output.
struct bench_document {
    const std::vector<bench_method_entry> *methods;
    const std::vector<bench_outcome> *outcomes;
    std::string pypi_version;
    int rounds;
    bool padded;
};
void bench_print_json(const bench_document &document);

#endif
