// SPDX-License-Identifier: Apache-2.0
// Our matcher and OpenCV's side by side: error, time and memory. See kUsage and README.md.
#include <thread>

#include "bench/harness/bench_arguments.hpp"
#include "bench/harness/bench_report.hpp"

namespace {

constexpr const char *kUsage =
    "usage: stereo_bench [options] DIR...\n"
    "  DIR            a folder with left.png right.png meta.json and, for the errors,\n"
    "                 disparity.pfm and mask.png; or a folder of such folders\n"
    "  --rounds N     interleaved rounds of all methods (default 7)\n"
    "  --quick        1 round\n"
    "  --errors-only  no timing: one run of each method\n"
    "  --only TEXT    methods whose name contains TEXT (and the reference)\n"
    "Times are of one grey pair; a ratio below 1 is faster than SGBM 3-way\n"
    "plain, on one thread in the same round (median, and quartiles over the rounds).\n";

int run(const bench_arguments &arguments, const std::vector<bench_pair> &pairs) {
    const std::vector<bench_method_entry> methods = bench_methods(arguments.only);
    const bench_rounds rounds = {arguments.errors_only ? 0 : arguments.rounds,
                                 std::thread::hardware_concurrency() > 1};
    bench_print_methods(methods);
    std::vector<bench_outcome> all;
    for (const bench_pair &pair : pairs) {
        const std::vector<bench_outcome> outcomes = bench_run_pair(methods, pair, rounds);
        bench_print_table(pair, outcomes);
        all.insert(all.end(), outcomes.begin(), outcomes.end());
    }
    bench_print_summaries(all);
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    return bench_main({"stereo_bench", kUsage, {"--rounds", "--quick", "--errors-only", "--only"}},
                      argc, argv, run);
}
