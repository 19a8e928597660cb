// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_arguments.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <stdexcept>

namespace {

// Wrong usage, as opposed to a failure.
struct usage_error : std::runtime_error {
    using std::runtime_error::runtime_error;
};

int parse_rounds(const char *text) {
    char *end = nullptr;
    const long rounds = std::strtol(text, &end, 10);
    if (*end != '\0' || rounds < 1 || rounds > 10000) {
        throw usage_error("--rounds must be a number from 1 to 10000");
    }
    return static_cast<int>(rounds);
}

bench_arguments parse(const bench_program &program, int argc, char **argv) {
    bench_arguments result;
    const std::map<std::string, bool *> flags = {{"--quick", &result.quick},
                                                 {"--errors-only", &result.errors_only}};
    std::string rounds;
    const std::map<std::string, std::string *> values = {{"--rounds", &rounds},
                                                         {"--only", &result.only},
                                                         {"--sheet", &result.sheet},
                                                         {"--maps", &result.maps}};
    const auto known = [&program](const std::string &word) {
        return std::find(program.options.begin(), program.options.end(), word) !=
               program.options.end();
    };
    for (int i = 1; i < argc; i++) {
        const std::string word = argv[i];
        if (word[0] != '-') {
            result.paths.push_back(word);
        } else if (!known(word)) {
            throw usage_error("unknown option " + word + "; see --help");
        } else if (flags.count(word) > 0) {
            *flags.at(word) = true;
        } else if (i + 1 == argc) {
            throw usage_error(word + " requires a value; see --help");
        } else {
            *values.at(word) = argv[++i];
        }
    }
    if (!rounds.empty()) {
        result.rounds = parse_rounds(rounds.c_str());
    } else if (result.quick) {
        result.rounds = 1;
    }
    if (result.paths.empty()) {
        throw usage_error("no folder of pairs; see --help");
    }
    return result;
}

bool has_name(const std::vector<bench_pair> &pairs, const std::string &name) {
    return std::any_of(pairs.begin(), pairs.end(),
                       [&name](const bench_pair &pair) { return pair.name == name; });
}

std::vector<bench_pair> load(const std::vector<std::string> &paths) {
    std::vector<bench_pair> pairs;
    for (const std::string &path : paths) {
        const std::vector<std::string> folders = bench_pair_folders(path);
        if (folders.empty()) {
            throw std::runtime_error(path + ": no left.png in it or in its sub-folders");
        }
        for (const std::string &folder : folders) {
            bench_pair pair;
            std::string message;
            if (!bench_pair_load(folder, &pair, &message)) {
                throw std::runtime_error(message);
            }
            // Results are identified by the pair's name.
            const std::string name = pair.name;
            for (int i = 2; has_name(pairs, pair.name); i++) {
                pair.name = name + " (" + std::to_string(i) + ")";
            }
            pairs.push_back(pair);
        }
    }
    return pairs;
}

}  // namespace

int bench_main(
    const bench_program &program, int argc, char **argv,
    const std::function<int(const bench_arguments &, const std::vector<bench_pair> &)> &work) {
    for (int i = 1; i < argc; i++) {
        if (argv[i] == std::string("--help") || argv[i] == std::string("-h")) {
            std::fputs(program.usage, stdout);
            return 0;
        }
    }
    try {
        const bench_arguments arguments = parse(program, argc, argv);
        return work(arguments, load(arguments.paths));
    } catch (const usage_error &error) {
        std::fprintf(stderr, "%s: %s\n", program.name, error.what());
        return 2;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s: %s\n", program.name, error.what());
        return 1;
    }
}
