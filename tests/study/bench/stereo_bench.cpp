// SPDX-License-Identifier: Apache-2.0
// Our matcher and OpenCV's side by side: error, time and memory. See kUsage and README.md.
#include <algorithm>
#include <thread>

#include "bench/disturbance.hpp"
#include "bench/harness/bench_arguments.hpp"
#include "bench/harness/bench_maps.hpp"
#include "bench/harness/bench_report.hpp"
#include "bench/harness/bench_sheet.hpp"

namespace {

constexpr const char *kUsage =
    "usage: stereo_bench [options] DIR...\n"
    "  DIR            a folder with left.png right.png meta.json and, for the errors,\n"
    "                 disparity.pfm and mask.png; or a folder of such folders\n"
    "  --rounds N     interleaved rounds of all methods (default 7)\n"
    "  --quick        1 round, without the errors of noisy images\n"
    "  --errors-only  no timing: one run of each method\n"
    "  --only TEXTS   methods whose name contains one of these, separated by commas (and the\n"
    "                 reference)\n"
    "  --sheet FILE   a picture (.webp, .jpg): of each pair our map and HH4's, and their errors\n"
    "  --maps DIR     each pair's truth and the methods' maps and reasons, as arrays of numpy\n"
    "Times are of one grey pair; a ratio below 1 is faster than SGBM 3-way\n"
    "plain, on one thread in the same round (median, and quartiles over the rounds).\n";

// bad-1.0 of each method with a noisy right image.
void add_noise_errors(const std::vector<bench_method_entry> &methods, const bench_pair &pair,
                      std::vector<bench_outcome> &outcomes) {
    const std::vector<disturbance> &all = photometric_disturbances();
    const auto noise = std::find_if(all.begin(), all.end(), [](const disturbance &one) {
        return std::string(one.name) == disturbance_noise;
    });
    bench_pair noisy = disturbance_copy(pair);
    noise->apply(noisy);
    for (std::size_t i = 0; i < methods.size(); i++) {
        const auto method = methods[i].make(noisy);
        method->run(1);
        const bench_error error = bench_error_of(noisy, method->disparity_px());
        outcomes[i].noise_bad_1px = {error.all.filled_visible.bad_percent[1]};
    }
}

int run(const bench_arguments &arguments, const std::vector<bench_pair> &pairs) {
    const std::vector<bench_method_entry> methods = bench_methods(arguments.only);
    const bench_rounds rounds = {arguments.errors_only ? 0 : arguments.rounds,
                                 std::thread::hardware_concurrency() > 1};
    bench_print_methods(methods);
    std::vector<bench_outcome> all;
    bench_sheet sheet;
    for (const bench_pair &pair : pairs) {
        // Of rendered scenes only the errors: their times are those of any pair of their size.
        std::vector<bench_outcome> outcomes =
            bench_run_pair(methods, pair, pair.is_rendered() ? bench_rounds{0, false} : rounds);
        if (!arguments.quick && !pair.is_rendered() && !pair.truth_px.empty()) {
            add_noise_errors(methods, pair, outcomes);
        }
        bench_print_table(pair, outcomes);
        sheet.add(pair, outcomes);
        if (!arguments.maps.empty()) {
            bench_write_maps(arguments.maps, pair, outcomes);
        }
        for (bench_outcome &one : outcomes) {
            one.disparity_px = {};  // else those of all pairs take gigabytes
            one.planes = {};
        }
        all.insert(all.end(), outcomes.begin(), outcomes.end());
    }
    bench_print_summaries(all);
    if (!arguments.sheet.empty()) {
        sheet.write(arguments.sheet);
    }
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    return bench_main({"stereo_bench",
                       kUsage,
                       {"--rounds", "--quick", "--errors-only", "--only", "--sheet", "--maps"}},
                      argc, argv, run);
}
