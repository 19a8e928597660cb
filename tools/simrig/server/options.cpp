// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/options.hpp"

#include <map>
#include <sstream>

#include "tools/simrig/server/listener.hpp"
#include "tools/simrig/wire/log.hpp"

namespace simrig {

const char *const kUsage =
    "usage: simrig --scene SCENE --listen WHERE [options]\n"
    "       simrig --scene SCENE --view DIR [options]\n"
    "       simrig --from LOG [--until SECONDS] --listen WHERE [options]\n"
    "       simrig --replay LOG [--rig RIG] [--scene SCENE] [--threads N]\n"
    "\n"
    "The simulated rig: two cameras with motorized zoom lenses on pan servos look at a scene. All\n"
    "that the board sees of them comes through the FPGA bridge's own Verilog. Programs connect "
    "with\n"
    "the protocol that tools/simrig/README.md describes.\n"
    "\n"
    "  --scene SCENE    what the cameras see: a name (still_life, cylinder, ...) or a YAML file\n"
    "  --rig RIG        the rig and its imperfections: default (the default), perfect, or a YAML\n"
    "                   file\n"
    "  --listen WHERE   unix:PATH, or tcp:PORT on this machine's loopback (0: any free one)\n"
    "  --hint TEXT      also print TEXT when ready; ADDRESS in it is replaced by WHERE\n"
    "  --seed N         of all random numbers (default 1); the same seed and the same requests\n"
    "                   give the same answers\n"
    "  --begin SECONDS  the rig's time at the start, an integer from 0 (default) to 1000000: as "
    "if\n"
    "                   it had run for so long\n"
    "  --threads N      for rendering (default 1); images do not depend on it\n"
    "  --wall           the rig's time follows the clock; without it, only requests advance it\n"
    "  --every-clock    feed the bridge both sensors' clocks and pixels all the time, not only\n"
    "                   while a frame is armed; without it the bridge's frame counts and times\n"
    "                   and its pixel clock measurement cover armed frames only. Costs several\n"
    "                   CPU seconds per second\n"
    "  --pty            with --wall: also offer the lens controller's line as a pseudo terminal\n"
    "  --files DIR      where the commands truth and view may write (default: nowhere)\n"
    "  --script FILE    control commands to run first, one per line (see --help-control)\n"
    "  --log FILE       record all requests there, for --replay and --from\n"
    "  --replay LOG     repeat all recorded requests and compare the answers\n"
    "  --from LOG       repeat them first, then serve; a new log includes them\n"
    "  --until SECONDS  with --from: only requests before this time of the rig\n"
    "  --view DIR       write what both cameras see (left.png, right.png) and a drawing of rig "
    "and\n"
    "                   scene (rig.svg), then exit unless --listen is given\n"
    "  --zoom FACTOR    of --view: 1 (default) to 10\n"
    "  --focus MM       of --view: focus distance (default 1800)\n"
    "  --help, --version, --help-control\n"
    "\n"
    "When ready, prints 'listening on WHERE' and the hint. SIGINT or SIGTERM ends it.\n"
    "Exit code: 0; 1 on failure, including a replay that differs; 2 for wrong usage; 3 for an\n"
    "unusable scene, rig, script or log.\n"
    "\n"
    "Examples\n"
    "    simrig --scene mug --listen unix:simrig.sock\n"
    "    simrig --scene chessboard --view pictures --zoom 3\n";

namespace {

uint64_t whole(const std::string &name, const std::string &text, uint64_t low, uint64_t high) {
    size_t used = 0;
    unsigned long long value = 0;
    try {
        value = text.find_first_of("+- ") == std::string::npos ? std::stoull(text, &used) : 0;
    } catch (const std::logic_error &) {
        used = 0;
    }
    if (used == 0 || used != text.size() || value < low || value > high) {
        throw WrongUsage(name + " must be an integer from " + std::to_string(low) + " to " +
                         std::to_string(high) + ", not '" + text + "'");
    }
    return value;
}

double real(const std::string &name, const std::string &text, double low, double high) {
    size_t used = 0;
    double value = 0;
    try {
        value = std::stod(text, &used);
    } catch (const std::logic_error &) {
        used = 0;
    }
    if (used == 0 || used != text.size() || !(value >= low && value <= high)) {
        std::ostringstream line;
        line << name << " must be a number from " << low << " to " << high << ", not '" << text
             << "'";
        throw WrongUsage(line.str());
    }
    return value;
}

void set_option(Options &options, const std::string &name, const std::string &value) {
    const std::map<std::string, std::string *> texts = {
        {"--rig", &options.rig},       {"--scene", &options.scene}, {"--listen", &options.listen},
        {"--log", &options.log},       {"--from", &options.from},   {"--replay", &options.replay},
        {"--script", &options.script}, {"--view", &options.view},   {"--files", &options.files},
        {"--hint", &options.hint},
    };
    const auto text = texts.find(name);
    if (text != texts.end()) {
        if (value.empty()) {
            throw WrongUsage(name + " must not be empty");
        }
        *text->second = value;
    } else if (name == "--seed") {
        options.seed = whole(name, value, 0, UINT32_MAX);
    } else if (name == "--begin") {
        options.begin_s = uint32_t(whole(name, value, 0, kLatestBeginS));
    } else if (name == "--threads") {
        options.threads = int(whole(name, value, 1, 64));
    } else if (name == "--until") {
        options.until_s = real(name, value, 0, 1e6);
    } else if (name == "--zoom") {
        options.zoom = real(name, value, 1, 10);
    } else if (name == "--focus") {
        options.focus_mm = real(name, value, 300, 1e7);
    } else {
        throw WrongUsage("unknown option '" + name + "'");
    }
}

void check_view(const Options &options) {
    const Options defaults;
    if (options.view.empty() &&
        (options.zoom != defaults.zoom || options.focus_mm != defaults.focus_mm)) {
        throw WrongUsage(
            "--zoom and --focus require --view (clients move the lenses of a rig that "
            "serves)");
    }
}

void check_place(const Options &options) {
    const std::string wrong_place =
        options.listen.empty() ? "" : Listener::wrong_place(options.listen);
    if (!wrong_place.empty()) {
        throw WrongUsage("--listen: " + wrong_place);
    }
}

void check_wall(const Options &options) {
    if (options.pty && !options.wall) {
        throw WrongUsage("--pty requires --wall");
    }
    if (options.wall &&
        (!options.log.empty() || !options.replay.empty() || !options.from.empty())) {
        throw WrongUsage(
            "--log, --replay and --from exclude --wall (wall time is not reproducible)");
    }
}

/// What goes with a rig that listens, or with one whose past is read from a log.
void check_pairs(const Options &options) {
    if (!options.hint.empty() && options.listen.empty()) {
        throw WrongUsage("--hint requires --listen");
    }
    if (options.until_s >= 0 && options.from.empty()) {
        throw WrongUsage("--until requires --from");
    }
    if ((options.every_clock || options.begin_s != 0) &&
        (!options.replay.empty() || !options.from.empty())) {
        throw WrongUsage(
            "--every-clock and --begin exclude --replay and --from (the log holds them)");
    }
    if (options.begin_s != 0 && options.wall) {
        throw WrongUsage("--begin excludes --wall (wall time begins with the clock)");
    }
}

void check_replay(const Options &options) {
    if (!options.replay.empty()) {
        if (!options.listen.empty() || !options.view.empty() || !options.from.empty() ||
            !options.log.empty() || !options.script.empty()) {
            throw WrongUsage("--replay allows only --rig, --scene, --files and --threads");
        }
    }
}

void check_needed(const Options &options) {
    if (!options.replay.empty()) {
        return;
    }
    if (options.listen.empty() && options.view.empty()) {
        throw WrongUsage("--listen or --view is required");
    }
    if (options.scene.empty() && options.from.empty()) {
        throw WrongUsage("--scene is required");
    }
}

void check(const Options &options) {
    check_view(options);
    check_place(options);
    check_wall(options);
    check_pairs(options);
    check_replay(options);
    check_needed(options);
}

}  // namespace

Options parse_options(int count, char **arguments) {
    Options options;
    const std::map<std::string, bool *> flags = {
        {"--wall", &options.wall},
        {"--pty", &options.pty},
        {"--every-clock", &options.every_clock},
        {"--help", &options.help},
        {"--help-control", &options.help_control},
        {"--version", &options.version},
    };
    for (int i = 1; i < count; i++) {
        const std::string name = arguments[i];
        const auto flag = flags.find(name);
        if (flag != flags.end()) {
            *flag->second = true;
        } else if (name.rfind("--", 0) != 0) {
            throw WrongUsage("unexpected argument '" + name + "'");
        } else if (i + 1 < count) {
            set_option(options, name, arguments[++i]);
        } else {
            throw WrongUsage("unknown option " + name + ", or its value is missing");
        }
        if (options.help || options.help_control || options.version) {
            return options;
        }
    }
    check(options);
    return options;
}

}  // namespace simrig
