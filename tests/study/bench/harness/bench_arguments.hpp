// SPDX-License-Identifier: Apache-2.0
/// The command line common to the benchmark programs.
#ifndef VERGENCE_TESTS_BENCH_BENCH_ARGUMENTS_HPP
#define VERGENCE_TESTS_BENCH_BENCH_ARGUMENTS_HPP

#include <functional>
#include <string>
#include <vector>

#include "bench/harness/bench_method.hpp"

struct bench_arguments {
    std::vector<std::string> paths;
    int rounds = 7;
    bool quick = false, errors_only = false;
    std::string only;   // parts of methods' names
    std::string sheet;  // file to write; empty: none
    std::string maps;   // folder to write; empty: none
};

/// One program: its name, its help text, and which of the options it accepts.
struct bench_program {
    const char *name, *usage;
    std::vector<std::string> options;
};

/// Exit code of a whole program: reads the command line, loads the pairs, works. Errors are one
/// line on standard error. 2 for wrong usage, 1 for everything else.
int bench_main(
    const bench_program &program, int argc, char **argv,
    const std::function<int(const bench_arguments &, const std::vector<bench_pair> &)> &work);

#endif
