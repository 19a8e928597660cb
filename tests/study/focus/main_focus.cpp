// SPDX-License-Identifier: Apache-2.0
// Focuses on random scenes, in several processes, and prints how well it went.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "focus_table.hpp"

using namespace focus;

namespace {

const char *const kUsage =
    R"(usage: focus_bench [--runs N] [--seed N] [--jobs N] [--methods LIST] [--lamps N]
                   [--scene N] [--failures N] [--short yes] [--write FILE]

Focuses both lenses of the rig on random scenes and prints how well that went.

  --runs N        scenes (default: 200)
  --seed N        of the random numbers (default: 20090915)
  --jobs N        processes (default: 1)
  --methods LIST  cold, table, or both, separated by a comma (default: cold,table)
  --scene N       this scene only, with all that is known about it
  --lamps N       percent of the scenes that have lamps (default: 10)
  --failures N    failures that are printed, one a line (default: 20)
  --short yes     the limits of a few hundred scenes, as tools/test --all has them
  --write FILE    the table, in Markdown
  --help          this text

Exit code: 0 when the limits hold, 1 when not, 2 for wrong usage.
)";

struct Options {
    unsigned runs = 200, jobs = 1, failures = 20;
    uint64_t seed = 20090915;
    long scene = -1;
    bool is_short = false;
    std::string write;
    std::vector<unsigned> methods;
};

/// All methods on a scene, each with a rig that was just switched on.
std::vector<Result> run_scene(const Options &options, unsigned index) {
    const Scene scene = draw_scene(options.seed, index);
    BlurStack stack;
    build_stack(scene, stack);
    std::vector<Result> results;
    for (const unsigned method : options.methods) {
        FocusBench bench(scene, stack);
        const int error = bench.bring_up();
        const double begin_s = bench.now_s();
        Reports reports;
        if (error == ERROR_OK) {
            reports = kMethodRows[method].focus(bench);
        }
        const double seconds = bench.now_s() - begin_s;
        for (unsigned side = 0; side < kSides; side++) {
            results.push_back(bench.result(method, side, reports[side]));
            results.back().both_seconds = seconds;
        }
        const char *what = bench.rig.last_error.text;
        if (options.scene >= 0 && *what != '\0') {
            std::fprintf(stderr, "%s: error %d: %s\n", kMethodRows[method].name, reports[0].error,
                         what);
        }
    }
    return results;
}

/// The scenes of one process, every jobs-th, to a pipe.
void run_share(const Options &options, unsigned job, int pipe) {
    for (unsigned index = job; index < options.runs; index += options.jobs) {
        for (const Result &result : run_scene(options, index)) {
            if (write(pipe, &result, sizeof result) != ssize_t(sizeof result)) {
                std::_Exit(1);
            }
        }
    }
    std::_Exit(0);
}

std::vector<Result> run_all(const Options &options) {
    int ends[2];
    if (pipe(ends) != 0) {
        std::perror("pipe");
        std::exit(1);
    }
    static_assert(sizeof(Result) <= PIPE_BUF, "results of several processes stay whole");
    for (unsigned job = 0; job < options.jobs; job++) {
        const pid_t child = fork();
        if (child < 0) {
            std::perror("fork");
            std::exit(1);
        }
        if (child == 0) {
            close(ends[0]);
            run_share(options, job, ends[1]);
        }
    }
    close(ends[1]);
    std::vector<Result> results;
    Result result;
    const std::size_t all = std::size_t(options.runs) * options.methods.size() * kSides;
    while (read(ends[0], &result, sizeof result) == ssize_t(sizeof result)) {
        results.push_back(result);
        if (isatty(2) && results.size() % 100 == 0) {
            std::fprintf(stderr, "\r%zu of %zu", results.size(), all);
        }
    }
    while (wait(nullptr) > 0) {
    }
    if (results.size() != all) {
        std::fprintf(stderr, "a process ended early: %zu of %zu results\n", results.size(), all);
        std::exit(1);
    }
    std::sort(results.begin(), results.end(), [](const Result &a, const Result &b) {
        return std::tie(a.scene, a.method, a.side) < std::tie(b.scene, b.method, b.side);
    });
    return results;
}

unsigned long number(const char *text) {
    char *end = nullptr;
    const unsigned long value = std::strtoul(text, &end, 10);
    if (*text == '\0' || *end != '\0') {
        std::fprintf(stderr, "focus_bench: \"%s\" is not an integer\n", text);
        std::exit(2);
    }
    return value;
}

std::vector<unsigned> methods_of(const std::string &list) {
    std::vector<unsigned> methods;
    for (unsigned method = 0; method < kMethods; method++) {
        if (("," + list + ",").find("," + std::string(kMethodRows[method].option) + ",") !=
            std::string::npos) {
            methods.push_back(method);
        }
    }
    return methods;
}

Options options_of(int argc, char **argv) {
    Options options;
    std::string methods = "cold,table";
    for (int i = 1; i < argc; i++) {
        const std::string name = argv[i];
        if (name == "--help") {
            std::fputs(kUsage, stdout);
            std::exit(0);
        }
        if (i + 1 == argc) {
            std::fputs(kUsage, stderr);
            std::exit(2);
        }
        const char *value = argv[++i];
        if (name == "--methods") {
            methods = value;
        } else if (name == "--runs") {
            options.runs = unsigned(number(value));
        } else if (name == "--seed") {
            options.seed = number(value);
        } else if (name == "--jobs") {
            options.jobs = std::max(1U, unsigned(number(value)));
        } else if (name == "--scene") {
            options.scene = long(number(value));
        } else if (name == "--lamps") {
            lamps_share = double(number(value)) / 100;
        } else if (name == "--short") {
            options.is_short = std::strcmp(value, "yes") == 0;
        } else if (name == "--write") {
            options.write = value;
        } else if (name == "--failures") {
            options.failures = unsigned(number(value));
        } else {
            std::fprintf(stderr, "focus_bench: unknown option %s\n", name.c_str());
            std::exit(2);
        }
    }
    options.methods = methods_of(methods);
    return options;
}

/// All that is known about a scene.
void print_scene(const Options &options) {
    const Scene scene = draw_scene(options.seed, unsigned(options.scene));
    std::printf("%s\n", scene.text().c_str());
    for (const Result &result : run_scene(options, scene.index)) {
        const char *failure = failure_of(result);
        if (failure != nullptr) {
            print_failure(result);
        } else {
            std::printf(
                "%s, %s: %s at %.1f, best %.1f +-%.1f, blur %.2f px (reported %.2f), %s, "
                "%.1f s, %u frames\n",
                kMethodRows[result.method].name, result.side == 0 ? "left" : "right",
                kVerdictNames[std::size_t(result.report.verdict)], result.ring, result.best,
                result.tolerance, result.blur_px, result.report.blur_px,
                kSceneClassNames[int(result.kind)], result.report.seconds, result.report.frames);
        }
    }
}

}  // namespace

int main(int argc, char **argv) {
    const Options options = options_of(argc, argv);
    if (options.scene >= 0) {
        print_scene(options);
        return 0;
    }
    const std::vector<Result> results = run_all(options);
    unsigned shown = 0;
    for (const Result &result : results) {
        if (failure_of(result) != nullptr && shown < options.failures) {
            print_failure(result);
            shown++;
        }
    }
    print_table(stdout, results);
    const bool holds = limits_hold(results, options.is_short ? kShortLimits : kLimits);
    if (!options.write.empty()) {
        std::FILE *file = std::fopen(options.write.c_str(), "w");
        if (file == nullptr || (print_table(file, results), std::fclose(file)) != 0) {
            std::perror(options.write.c_str());
            return 1;
        }
    }
    std::printf("%u scenes, seed %llu: %s\n", options.runs,
                static_cast<unsigned long long>(options.seed),
                holds ? "all limits hold" : "A LIMIT DOES NOT HOLD");
    return holds ? 0 : 1;
}
