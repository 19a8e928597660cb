// SPDX-License-Identifier: Apache-2.0
// Our matcher and OpenCV's side by side in one process: time, error and memory. See usage().
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <thread>

#include "bench/bench_method.hpp"
#include "bench/bench_report.hpp"
#include "bench/memory_count.hpp"
#include "tools/host/evaluate.hpp"

namespace {

struct arguments {
    std::vector<std::string> paths;
    int rounds = 7;
    bool json = false;
    bool padded = true;
    bool errors_only = false;
    std::string only;  // part of a method's name
};

void usage(FILE *stream) {
    std::fputs(
        "usage: stereo_bench [options] DIR...\n"
        "  DIR            a folder with left.png right.png meta.json and, for the errors,\n"
        "                 disparity.pfm and mask.png; or a folder of such folders\n"
        "  --rounds N     interleaved rounds of all methods (default 7)\n"
        "  --quick        1 round\n"
        "  --errors-only  no timing: one run of each method\n"
        "  --only TEXT    methods whose name contains TEXT (and the reference)\n"
        "  --unpadded     OpenCV leaves the left border unsearched: faster, fewer pixels\n"
        "  --json         machine-readable result on standard output\n"
        "Times are the best of the rounds on one grey pair; a ratio below 1 is faster than\n"
        "OpenCV's SGBM 3-way in the same round (median, and quartiles over the rounds).\n",
        stream);
}

bool parse_arguments(int argc, char **argv, arguments *result) {
    for (int i = 1; i < argc; i++) {
        const std::string word = argv[i];
        if (word == "--help" || word == "-h") {
            usage(stdout);
            std::exit(0);
        } else if (word == "--json") {
            result->json = true;
        } else if (word == "--quick") {
            result->rounds = 1;
        } else if (word == "--unpadded") {
            result->padded = false;
        } else if (word == "--errors-only") {
            result->errors_only = true;
        } else if (word == "--only" && i + 1 < argc) {
            result->only = argv[++i];
        } else if (word == "--rounds" && i + 1 < argc) {
            char *end = nullptr;
            const long rounds = std::strtol(argv[++i], &end, 10);
            if (*end != '\0' || rounds < 1 || rounds > 10000) {
                std::fprintf(stderr, "stereo_bench: --rounds wants a number from 1 to 10000\n");
                return false;
            }
            result->rounds = static_cast<int>(rounds);
        } else if (word[0] == '-') {
            std::fprintf(stderr, "stereo_bench: unknown option %s; see --help\n", word.c_str());
            return false;
        } else {
            result->paths.push_back(word);
        }
    }
    if (result->paths.empty()) {
        std::fprintf(stderr, "stereo_bench: no folder of pairs was named; see --help\n");
        return false;
    }
    return true;
}

double run_ms(bench_method &method) {
    const auto begin = std::chrono::steady_clock::now();
    method.run();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - begin;
    return taken.count();
}

double quantile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    const double at = share * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(at);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

bool wanted(const bench_method_entry &entry, const arguments &args) {
    return args.only.empty() || std::strcmp(entry.name, bench_reference) == 0 ||
           std::string(entry.name).find(args.only) != std::string::npos;
}

// One run of a fresh method: its result against the truth, and its memory.
bench_outcome run_once(const bench_method_entry &entry, const bench_pair &pair,
                       const arguments &args) {
    bench_outcome result;
    result.pair = pair.name;
    result.method = entry.name;
    result.is_ours = entry.is_ours;
    result.width = pair.left.cols;
    result.height = pair.left.rows;
    result.disparities = pair.disparity_count;
    const auto method = entry.make(pair, {1, args.padded});
    memory_count_begin();
    method->run();
    result.memory_bytes = memory_count_peak_bytes();
    if (method->known_memory_bytes() > 0) {
        result.memory_bytes += method->known_memory_bytes();
    }
    const std::vector<float> disparity = method->disparity_px();
    const auto kept =
        std::count_if(disparity.begin(), disparity.end(), [](float d) { return std::isfinite(d); });
    result.density_percent =
        100 * static_cast<double>(kept) / static_cast<double>(disparity.size());
    result.has_truth = !pair.truth_px.empty();
    if (result.has_truth) {
        evaluate_input input;
        input.width_px = result.width;
        input.height_px = result.height;
        input.disparity_px = disparity.data();
        input.truth_px = pair.truth_px.data();
        input.mask = pair.mask.data();
        input.round_disparity = pair.round_disparity;
        result.errors = evaluate_disparity(input);
    }
    return result;
}

// Interleaved rounds: a slow spell of the computer meets all methods alike.
void time_rounds(const bench_pair &pair, const arguments &args, int threads,
                 std::vector<bench_outcome> &outcomes) {
    std::vector<std::unique_ptr<bench_method>> methods;
    std::vector<std::vector<double>> times;
    std::size_t reference = 0;
    for (const bench_method_entry &entry : bench_methods()) {
        if (wanted(entry, args)) {
            if (std::strcmp(entry.name, bench_reference) == 0) {
                reference = methods.size();
            }
            methods.push_back(entry.make(pair, {threads, args.padded}));
            methods.back()->run();  // fills caches and buffers
        }
    }
    times.resize(methods.size());
    for (int round = 0; round < args.rounds; round++) {
        for (std::size_t i = 0; i < methods.size(); i++) {
            times[i].push_back(run_ms(*methods[i]));
        }
    }
    for (std::size_t i = 0; i < methods.size(); i++) {
        std::vector<double> ratios;
        for (std::size_t round = 0; round < times[i].size(); round++) {
            ratios.push_back(times[i][round] / times[reference][round]);
        }
        outcomes[i].timing_by_threads[threads] = {quantile(times[i], 0), quantile(ratios, 0.5),
                                                  quantile(ratios, 0.25), quantile(ratios, 0.75)};
    }
}

std::vector<bench_outcome> run_pair(const bench_pair &pair, const arguments &args,
                                    int all_threads) {
    std::vector<bench_outcome> outcomes;
    for (const bench_method_entry &entry : bench_methods()) {
        if (wanted(entry, args)) {
            outcomes.push_back(run_once(entry, pair, args));
        }
    }
    if (!args.errors_only) {
        time_rounds(pair, args, 1, outcomes);
        if (all_threads > 1) {
            time_rounds(pair, args, all_threads, outcomes);
        }
    }
    return outcomes;
}

int run(const arguments &args) {
    std::vector<std::string> folders;
    for (const std::string &path : args.paths) {
        const std::vector<std::string> found = bench_pair_folders(path);
        if (found.empty()) {
            std::fprintf(stderr, "stereo_bench: %s: no left.png in it or in its sub-folders\n",
                         path.c_str());
            return 1;
        }
        folders.insert(folders.end(), found.begin(), found.end());
    }
    const auto all_threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    std::vector<bench_outcome> all;
    for (const std::string &folder : folders) {
        bench_pair pair;
        std::string message;
        if (!bench_pair_load(folder, &pair, &message)) {
            std::fprintf(stderr, "stereo_bench: %s\n", message.c_str());
            return 1;
        }
        const std::vector<bench_outcome> outcomes = run_pair(pair, args, all_threads);
        if (!args.json) {
            bench_print_table(pair, outcomes);
        }
        all.insert(all.end(), outcomes.begin(), outcomes.end());
    }
    if (args.json) {
        bench_print_json(all, args.rounds, args.padded);
    } else if (folders.size() > 1) {
        bench_print_means(all);
    }
    return 0;
}

}  // namespace

int main(int argc, char **argv) {
    arguments args;
    if (!parse_arguments(argc, argv, &args)) {
        return 2;
    }
    try {
        return run(args);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "stereo_bench: %s\n", error.what());
        return 1;
    }
}
