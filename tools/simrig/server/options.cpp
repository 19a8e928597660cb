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
    "The simulated rig: two cameras with motorized zoom lenses on pan servos look at a scene; all\n"
    "that the board sees of them comes through the FPGA bridge's own Verilog. Programs connect to\n"
    "it by the protocol that tools/simrig/README.md describes.\n"
    "\n"
    "  --scene SCENE    what is looked at: a name (still_life, cylinder, ...) or a YAML file\n"
    "  --rig RIG        what the rig is, with all its faults: default (if not told), perfect, or\n"
    "                   a YAML file\n"
    "  --listen WHERE   unix:PATH, or tcp:PORT on this machine's loopback (0: any free one)\n"
    "  --hint TEXT      print TEXT, too, when it is ready; ADDRESS in it becomes WHERE as it is "
    "then\n"
    "  --seed N         of all noise and chance (default 1); the same seed and the same requests\n"
    "                   give the same answers\n"
    "  --begin SECONDS  the rig's time when it comes to life (default 0), as of a machine that "
    "has\n"
    "                   run for so long: 0 to 1000000, a whole number\n"
    "  --threads N      for pictures (default 1); the same pictures with any number\n"
    "  --wall           the rig's time is the clock's; otherwise it passes by requests alone\n"
    "  --every-clock    both sensors' clocks and pixels reach the bridge all the time, not only\n"
    "                   while a frame is armed; without it its counts and times of frames, its\n"
    "                   measured pixel clocks and their loss are of armed frames alone. A second\n"
    "                   then costs several seconds of a processor\n"
    "  --pty            with --wall: the lens controller's line as a pseudo terminal too\n"
    "  --files DIR      where the commands truth and view may write; without it they may not\n"
    "  --script FILE    control commands to begin with, a line each (see --help-control)\n"
    "  --log FILE       write all requests there, for --replay and --from\n"
    "  --replay LOG     ask a rig all of it again and compare its answers\n"
    "  --from LOG       begin with all of it, then serve; the new log holds it too\n"
    "  --until SECONDS  with --from: only what was asked before this time of the rig\n"
    "  --view DIR       write what both cameras see, left.png and right.png, and a drawing of rig\n"
    "                   and scene, rig.svg; then end, unless --listen is there too\n"
    "  --zoom FACTOR    of --view: 1 (default) to 10\n"
    "  --focus MM       of --view: distance that is sharp (default 1800)\n"
    "  --help, --version, --help-control\n"
    "\n"
    "When it is ready it prints one line: 'listening on WHERE', and the hint. It ends with SIGINT "
    "or SIGTERM.\n"
    "Exit code: 0; 1 when something failed, also a replay that differs; 2 for wrong usage; 3 when\n"
    "a scene, rig, script or log cannot be used.\n"
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
        throw WrongUsage(name + " wants a whole number from " + std::to_string(low) + " to " +
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
        line << name << " wants a number from " << low << " to " << high << ", not '" << text
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
            throw WrongUsage(name + " wants more than an empty word");
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
        throw WrongUsage("option '" + name + "' is not known");
    }
}

void check_view(const Options &options) {
    const Options usual;
    if (options.view.empty() &&
        (options.zoom != usual.zoom || options.focus_mm != usual.focus_mm)) {
        throw WrongUsage(
            "--zoom and --focus go with --view; the lenses of a rig that serves are "
            "its clients' to move");
    }
}

void check(const Options &options) {
    check_view(options);
    const std::string wrong_place =
        options.listen.empty() ? "" : Listener::wrong_place(options.listen);
    if (!wrong_place.empty()) {
        throw WrongUsage("--listen: " + wrong_place);
    }
    if (options.pty && !options.wall) {
        throw WrongUsage("a pseudo terminal needs --wall: its other end lives in the clock's time");
    }
    if (options.wall &&
        (!options.log.empty() || !options.replay.empty() || !options.from.empty())) {
        throw WrongUsage(
            "with --wall no run is like another: --log, --replay and --from do not go with it");
    }
    if (!options.hint.empty() && options.listen.empty()) {
        throw WrongUsage("--hint goes with --listen");
    }
    if (options.until_s >= 0 && options.from.empty()) {
        throw WrongUsage("--until goes with --from");
    }
    if ((options.every_clock || options.begin_s != 0) &&
        (!options.replay.empty() || !options.from.empty())) {
        throw WrongUsage(
            "--every-clock and --begin are as they were in the log that --replay or "
            "--from reads");
    }
    if (options.begin_s != 0 && options.wall) {
        throw WrongUsage("with --wall time begins with the clock's: --begin does not go with it");
    }
    if (!options.replay.empty()) {
        if (!options.listen.empty() || !options.view.empty() || !options.from.empty() ||
            !options.log.empty() || !options.script.empty()) {
            throw WrongUsage("--replay goes with --rig, --scene, --files and --threads only");
        }
        return;
    }
    if (options.listen.empty() && options.view.empty()) {
        throw WrongUsage("--listen or --view is wanted");
    }
    if (options.scene.empty() && options.from.empty()) {
        throw WrongUsage("--scene is wanted");
    }
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
            throw WrongUsage("'" + name + "' is not an option");
        } else if (i + 1 < count) {
            set_option(options, name, arguments[++i]);
        } else {
            throw WrongUsage(name + " wants a value, or is not known");
        }
        if (options.help || options.help_control || options.version) {
            return options;
        }
    }
    check(options);
    return options;
}

}  // namespace simrig
