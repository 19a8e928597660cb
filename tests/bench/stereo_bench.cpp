// SPDX-License-Identifier: Apache-2.0
// Our matcher and OpenCV's side by side: error, time and memory. See kUsage and README.md.
#include <thread>

#include "bench/harness/bench_arguments.hpp"
#include "bench/harness/bench_report.hpp"
#include "bench/harness/bench_settings.hpp"

namespace {

constexpr const char *kUsage =
    "usage: stereo_bench [options] DIR...\n"
    "  DIR            a folder with left.png right.png meta.json and, for the errors,\n"
    "                 disparity.pfm and mask.png; or a folder of such folders\n"
    "  --rounds N     interleaved rounds of all methods (default 7)\n"
    "  --quick        1 round\n"
    "  --errors-only  no timing: one run of each method\n"
    "  --only TEXT    methods whose name contains TEXT (and the reference)\n"
    "  --pypi FOLDER  also the OpenCV of the Python module cv2 in FOLDER, in its own process\n"
    "  --unpadded     OpenCV leaves the left border unsearched: faster, fewer pixels\n"
    "  --settings     searches the best setting of each of OpenCV's modes, measures no time\n"
    "  --json         machine-readable result on standard output\n"
    "Times are of one grey pair; a ratio below 1 is faster than the linked SGBM 3-way\n"
    "plain, on one thread in the same round (median, and quartiles over the rounds).\n";

int run(const bench_arguments &arguments, const std::vector<bench_pair> &pairs) {
    const bench_choice choice = bench_choice_of(arguments);
    if (arguments.settings) {
        bench_print_settings(bench_search_settings(pairs, choice), arguments.json);
        return 0;
    }
    const std::vector<bench_method_entry> methods = bench_methods(choice);
    const bench_rounds rounds = {arguments.errors_only ? 0 : arguments.rounds,
                                 std::thread::hardware_concurrency() > 1};
    if (!arguments.json) {
        bench_print_methods(methods, bench_pypi_version(choice));
    }
    std::vector<bench_outcome> all;
    for (const bench_pair &pair : pairs) {
        const std::vector<bench_outcome> outcomes = bench_run_pair(methods, pair, rounds);
        if (!arguments.json) {
            bench_print_table(pair, outcomes);
        }
        all.insert(all.end(), outcomes.begin(), outcomes.end());
    }
    if (arguments.json) {
        bench_print_json({&methods, &all, bench_pypi_version(choice), rounds.count, choice.padded});
    } else {
        bench_print_summaries(bench_summaries(all));
    }
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    return bench_main({"stereo_bench",
                       kUsage,
                       {"--rounds", "--quick", "--errors-only", "--only", "--pypi", "--unpadded",
                        "--settings", "--json"}},
                      argc, argv, run);
}
