// SPDX-License-Identifier: Apache-2.0
// The simulated rig shares no code with what it tests: it is a separate program, which this one
// executes.
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

#include "daemon/cli/options.h"
#include "tools/host/commands/commands.hpp"
#include "tools/host/formats/report_text.hpp"

namespace {

struct request {
    const char *rig, *listen, *files, *script, *log, *from, *replay, *view;
    int seed = -1, begin_s = -1, threads = -1;
    double zoom = -1, focus_mm = -1, until_s = -1;
    bool wall, pty, every_clock;
};

const command_argument options[] = {
    text_option("rig", offsetof(request, rig), "RIG",
                "The rig: \"default\" (realistic, with all faults), \"perfect\", or a YAML file."),
    text_option(
        "listen", offsetof(request, listen), "ADDRESS",
        "Where programs connect: unix:PATH, or tcp:PORT on this machine's loopback (0: any free "
        "one). Default: unix:simrig.sock in this directory."),
    number_option(
        "seed", COMMAND_INTEGER, offsetof(request, seed), "N",
        "Seed of all randomness: the same seed and the same requests give the same answers. "
        "Default: 1.",
        0, 2147483647, 1, 0),
    number_option("begin", COMMAND_INTEGER, offsetof(request, begin_s), "SECONDS",
                  "The rig's time at its start, like the uptime of a machine. Default: 0.", 0,
                  1000000, -1, 0, "s"),
    flag_option("wall", offsetof(request, wall),
                "The rig's time follows the wall clock. Otherwise only requests advance it."),
    flag_option(
        "every-clock", offsetof(request, every_clock),
        "Both sensors' clocks and pixels reach the FPGA all the time, not only while a frame is "
        "armed: "
        "its counts of frames are then of all. Slow."),
    flag_option("pty", offsetof(request, pty),
                "With --wall: the lens controller's line also as a pseudo terminal."),
    text_option("view", offsetof(request, view), "DIR",
                "Save what each camera sees (left.png, right.png) and a drawing of rig and scene "
                "(rig.svg), "
                "then exit, unless --listen is also given."),
    number_option("zoom", COMMAND_NUMBER, offsetof(request, zoom), "FACTOR",
                  "Zoom of --view: 1 (default) to 10.", 1, 10, 0, 0, "x"),
    number_option("focus", COMMAND_NUMBER, offsetof(request, focus_mm), "MM",
                  "Focus distance of --view. Default: 1800.", 300, 1e7, 0, 0, "mm"),
    text_option("script", offsetof(request, script), "FILE",
                "Control commands to run first, one per line: timed faults, poses."),
    text_option("files", offsetof(request, files), "DIR",
                "Directory where the control commands truth and view may write."),
    text_option("log", offsetof(request, log), "FILE",
                "Write all requests to this file, for --replay and --from."),
    text_option("replay", offsetof(request, replay), "LOG",
                "Repeat all logged requests, compare the answers, and exit."),
    text_option("from", offsetof(request, from), "LOG", "Repeat all logged requests, then serve."),
    number_option("until", COMMAND_NUMBER, offsetof(request, until_s), "SECONDS",
                  "With --from: only requests before this time of the rig.", 0, 1e6, 0, 0, "s"),
    number_option("threads", COMMAND_INTEGER, offsetof(request, threads), "N",
                  "Threads for rendering. Default: 1.", 1, 64, 1, 0),
};

const option_page page = {
    "vergence simulate",
    "[SCENE]",
    "start a simulated rig, or show what it would see",
    "Starts simrig: two cameras with motorized zoom lenses on pan servos, behind the FPGA bridge's "
    "own Verilog, look at SCENE: still_life (default), cylinder, mug, figurine, level, plane, "
    "chessboard, charuco, or a YAML file. Programs connect to it by a small protocol; "
    "tools/simrig/README.md describes it, the files, the control commands and the faults. It "
    "prints "
    "the two lines to type next, for the daemon and the client, and ends with Ctrl-C.\n"
    "Exit codes in addition to the common ones: 1 also when a replay differs, 3 when a scene, rig, "
    "script "
    "or "
    "log cannot be used.",
    "vergence simulate\n"
    "vergence simulate mug --listen tcp:0 --wall\n"
    "vergence simulate chessboard --view pictures --zoom 3\n"
    "vergence simulate --seed 7 --log run.log\n"
    "vergence simulate --replay run.log",
    options,
    sizeof options / sizeof options[0],
    0,
    1};

#ifdef VERGENCE_HAS_SIMRIG

const int number_digits = 9;

/// Path of this program; empty: unknown.
std::string own_path() {
    char self[4096];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    return length > 0 ? std::string(self, static_cast<size_t>(length)) : "";
}

/// The first of these paths, relative to this program's folder, where a program exists; empty:
/// none.
std::string program_at(std::initializer_list<const char *> places) {
    const std::string here = own_path();
    const std::string folder = here.substr(0, here.rfind('/') + 1);
    for (const char *place : places) {
        char path[PATH_MAX];
        if (!folder.empty() && access((folder + place).c_str(), X_OK) == 0 &&
            realpath((folder + place).c_str(), path) != nullptr) {
            return path;
        }
    }
    return "";
}

/// A word quoted for a shell.
std::string quoted(const std::string &word) {
    std::string text = "'";
    for (const char character : word) {
        text += character == '\'' ? std::string("'\\''") : std::string(1, character);
    }
    return text + "'";
}

std::string quoted_if_needed(const std::string &word) {
    static const char plain[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./+:=,@";
    return word.find_first_not_of(plain) == std::string::npos ? word : quoted(word);
}

/// An address by which vergenced finds the rig from any directory; a port is known only to the rig.
std::string address_of_rig(const std::string &listen) {
    if (listen.compare(0, 4, "tcp:") == 0) {
        return "ADDRESS";
    }
    char here[4096];
    const bool relative = listen.compare(0, 5, "unix:") == 0 && listen.compare(0, 6, "unix:/") != 0;
    if (relative && getcwd(here, sizeof here) != nullptr) {
        return "unix:" + std::string(here) + "/" + listen.substr(5);
    }
    return listen;
}

/// The next commands, ready to be copied.
std::string next_lines(const std::string &listen) {
    const std::string daemon = program_at({"vergenced", "../daemon/vergenced"});
    const std::string client = own_path();
    return "Next, in two other terminals:\n  " +
           quoted_if_needed(daemon.empty() ? "vergenced" : daemon) + " " +
           quoted("backend=sim " + address_of_rig(listen)) + "\n  " +
           quoted_if_needed(client.empty() ? "vergence" : client) + " --connect";
}

/// Options with a text; null ones were not given.
void add_texts(const request &asked, std::vector<std::string> *words) {
    const struct {
        const char *name, *value;
    } texts[] = {{"--rig", asked.rig},  {"--files", asked.files}, {"--script", asked.script},
                 {"--log", asked.log},  {"--from", asked.from},   {"--replay", asked.replay},
                 {"--view", asked.view}};
    for (const auto &text : texts) {
        if (text.value != nullptr) {
            words->insert(words->end(), {text.name, text.value});
        }
    }
}

/// Options with a number; those below 0 were not given.
void add_numbers(const request &asked, std::vector<std::string> *words) {
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"--zoom", asked.zoom}, {"--focus", asked.focus_mm}, {"--until", asked.until_s}};
    for (const auto &number : numbers) {
        if (number.value >= 0) {
            words->insert(words->end(), {number.name, number_text(number.value, number_digits)});
        }
    }
    const struct {
        const char *name;
        long long value;
    } integers[] = {
        {"--seed", asked.seed}, {"--begin", asked.begin_s}, {"--threads", asked.threads}};
    for (const auto &integer : integers) {
        if (integer.value >= 0) {
            words->insert(words->end(), {integer.name, std::to_string(integer.value)});
        }
    }
}

std::vector<std::string> arguments_of(const request &asked, const char *scene) {
    std::vector<std::string> words = {"simrig"};
    const auto add = [&words](const char *name, const std::string &value) {
        words.insert(words.end(), {name, value});
    };
    const bool has_past = asked.from != nullptr || asked.replay != nullptr;
    if (scene != nullptr || !has_past) {
        add("--scene", scene != nullptr ? scene : "still_life");
    }
    if (asked.listen != nullptr || (asked.view == nullptr && asked.replay == nullptr)) {
        const std::string address = asked.listen != nullptr ? asked.listen : "unix:simrig.sock";
        add("--listen", address);
        add("--hint", next_lines(address));
    }
    add_texts(asked, &words);
    add_numbers(asked, &words);
    const struct {
        const char *name;
        bool given;
    } flags[] = {
        {"--wall", asked.wall}, {"--pty", asked.pty}, {"--every-clock", asked.every_clock}};
    for (const auto &flag : flags) {
        if (flag.given) {
            words.emplace_back(flag.name);
        }
    }
    return words;
}

int become_simrig(const request &asked, const char *scene) {
    const std::string path = program_at({"simrig/simrig", "simrig"});
    if (path.empty()) {
        std::fputs("vergence simulate: the program simrig is not next to this one\n", stderr);
        return CLIENT_FAILED;
    }
    std::vector<std::string> words = arguments_of(asked, scene);
    std::vector<char *> arguments;
    for (std::string &word : words) {
        arguments.push_back(&word[0]);
    }
    arguments.push_back(nullptr);
    execv(path.c_str(), arguments.data());
    std::fprintf(stderr, "vergence simulate: cannot start %s: %s\n", path.c_str(),
                 std::strerror(errno));
    return CLIENT_FAILED;
}

#else

int become_simrig(const request &, const char *) {
    std::fputs(
        "vergence simulate: this build has no simulated rig: it requires Verilator and "
        "cmake -DVERGENCE_FPGA=ON\n",
        stderr);
    return CLIENT_FAILED;
}

#endif

}  // namespace

int command_simulate(int argc, char **argv) {
    request asked{};
    const char *scene = nullptr;
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &scene, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    return become_simrig(asked, count > 0 ? scene : nullptr);
}
