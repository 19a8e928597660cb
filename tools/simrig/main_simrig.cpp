// SPDX-License-Identifier: Apache-2.0
// simrig: the simulated rig as a process. See usage() and protocol/simrig_protocol.h.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "tools/simrig/rig/settings.hpp"
#include "tools/simrig/server/control.hpp"
#include "tools/simrig/server/log.hpp"
#include "tools/simrig/server/pty.hpp"
#include "tools/simrig/server/server.hpp"
#include "tools/simrig/world/document.hpp"

namespace {

using namespace simrig;

constexpr const char *kUsage =
    "usage: simrig --rig FILE --scene FILE --listen unix:PATH|tcp:PORT [options]\n"
    "       simrig --replay LOG [--rig FILE --scene FILE]\n"
    "\n"
    "The simulated rig: two cameras with motorized zoom lenses on pan servos look at a scene; all\n"
    "that the board sees of them comes through the FPGA bridge's own Verilog. Programs connect to\n"
    "it by the protocol of tools/simrig/protocol/simrig_protocol.h.\n"
    "\n"
    "  --rig FILE       what the rig is: lenses, servos, sensors and all their faults (YAML)\n"
    "  --scene FILE     what it looks at (YAML)\n"
    "  --listen WHERE   unix:PATH, or tcp:PORT on this machine's loopback (0: any free port)\n"
    "  --seed N         of all noise and chance (default 1); the same seed and the same requests\n"
    "                   give the same answers\n"
    "  --threads N      for pictures (default 1); the same pictures with any number\n"
    "  --wall           the rig's time is the clock's; otherwise it passes by requests alone\n"
    "  --pty            with --wall: the lens controller's line as a pseudo terminal too\n"
    "  --log FILE       write all requests there at the end, for --replay\n"
    "  --replay LOG     ask a rig all of it again and compare its answers\n"
    "  --help, --version, --help-control\n"
    "\n"
    "When it is ready it prints one line: 'listening on WHERE'. It ends with SIGINT or SIGTERM.\n"
    "Exit code: 0; 1 when something failed, also a replay that differs; 2 for wrong usage.\n";

struct Options {
    LogHead head;
    std::string listen, log, replay;
    int threads = 1;
    bool wall = false, pty = false;
};

struct WrongUsage : std::runtime_error {
    using std::runtime_error::runtime_error;
};

uint64_t whole(const std::string &name, const std::string &text, uint64_t low, uint64_t high) {
    size_t used = 0;
    unsigned long long value = 0;
    try {
        value = text.find('-') == std::string::npos ? std::stoull(text, &used) : 0;
    } catch (const std::logic_error &) {
        used = 0;
    }
    if (used == 0 || used != text.size() || value < low || value > high) {
        throw WrongUsage(name + " wants a whole number from " + std::to_string(low) + " to " +
                         std::to_string(high) + ", not '" + text + "'");
    }
    return value;
}

void set_option(Options &options, const std::string &name, const std::string &value) {
    if (name == "--rig") {
        options.head.rig = value;
    } else if (name == "--scene") {
        options.head.scene = value;
    } else if (name == "--listen") {
        options.listen = value;
    } else if (name == "--log") {
        options.log = value;
    } else if (name == "--replay") {
        options.replay = value;
    } else if (name == "--seed") {
        options.head.seed = whole(name, value, 0, UINT32_MAX);
    } else if (name == "--threads") {
        options.threads = int(whole(name, value, 1, 64));
    } else {
        throw WrongUsage("option '" + name + "' is not known");
    }
}

Options parse(int count, char **arguments) {
    Options options;
    options.head.seed = 1;
    for (int i = 1; i < count; i++) {
        const std::string name = arguments[i];
        if (name == "--wall") {
            options.wall = true;
        } else if (name == "--pty") {
            options.pty = true;
        } else if (i + 1 < count) {
            set_option(options, name, arguments[++i]);
        } else {
            throw WrongUsage(name.rfind("--", 0) == 0 ? name + " wants a value, or is not known"
                                                      : "'" + name + "' is not an option");
        }
    }
    if (options.pty && !options.wall) {
        throw WrongUsage("a pseudo terminal needs --wall: its other end lives in the clock's time");
    }
    if (options.wall && (!options.log.empty() || !options.replay.empty())) {
        throw WrongUsage(
            "with --wall no run is like another: --log and --replay do not go with it");
    }
    if (options.replay.empty() &&
        (options.head.rig.empty() || options.head.scene.empty() || options.listen.empty())) {
        throw WrongUsage("--rig, --scene and --listen are wanted");
    }
    return options;
}

int stop_pipe[2];

void stop(int) {
    const char byte = 0;
    // The pipe is full only when it has been written to often enough.
    if (write(stop_pipe[1], &byte, 1) < 0) {
        return;
    }
}

void catch_signals() {
    if (pipe2(stop_pipe, O_CLOEXEC | O_NONBLOCK) != 0) {
        throw std::runtime_error("cannot make a pipe");
    }
    struct sigaction action {};
    action.sa_handler = stop;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    signal(SIGPIPE, SIG_IGN);
}

/// Keeps the rig up with the clock.
class WallTime {
  public:
    explicit WallTime(Rig &rig)
        : rig_(rig), begin_(std::chrono::steady_clock::now()), begin_us_(rig.now_us()) {}

    void tick() {
        const std::chrono::duration<double, std::micro> passed =
            std::chrono::steady_clock::now() - begin_;
        const double until_us = begin_us_ + passed.count();
        // What cannot be computed in time comes late, in pieces, so that clients are heard.
        rig_.advance(std::min(until_us, rig_.now_us() + kPieceUs), 0);
    }

  private:
    static constexpr double kPieceUs = 20000;

    Rig &rig_;
    std::chrono::steady_clock::time_point begin_;
    double begin_us_;
};

/// The rig with all that belongs to it.
struct Setup {
    Stage stage;
    Rig rig;
    ControlDesk desk;
    Board board;

    static RigSettings settings(const Options &options) {
        RigSettings settings = load_settings(options.head.rig);
        settings.seed = options.head.seed;
        return settings;
    }
    explicit Setup(const Options &options)
        : stage(options.head.scene, options.head.rig, options.head.seed, options.threads),
          rig(settings(options),
              [this](int camera, const SensorFrame &frame, double begin_us,
                     const std::function<CameraState(double)> &state) {
                  return stage.picture(camera, frame, begin_us, state);
              }),
          desk(rig, stage),
          board(rig, options.head.rig, options.wall,
                [this](const std::string &command) { return desk.run(command); }) {}
};

int replay_log(Options options) {
    LogHead head;
    const std::vector<LogEntry> entries = read_log(options.replay, head);
    if (!options.head.rig.empty()) {
        head.rig = options.head.rig;
    }
    if (!options.head.scene.empty()) {
        head.scene = options.head.scene;
    }
    options.head = head;
    Setup setup(options);
    replay(setup.board, entries);
    std::printf("%zu requests, all answered as in the log\n", entries.size());
    return 0;
}

int serve(const Options &options) {
    catch_signals();
    Setup setup(options);
    Listener listener(options.listen);
    WallTime wall(setup.rig);
    std::unique_ptr<Pty> pty;
    if (options.pty) {
        pty = std::make_unique<Pty>();
        std::printf("lens controller on %s\n", pty->name().c_str());
    }
    std::function<void()> tick;
    if (options.wall) {
        tick = [&setup, &wall, &pty] {
            wall.tick();
            if (pty) {
                pty->exchange(setup.rig.serial(), setup.rig.now_us());
            }
        };
    }
    std::vector<LogEntry> entries;
    Server server(listener, setup.board, tick, options.log.empty() ? nullptr : &entries);
    std::printf("listening on %s\n", listener.name().c_str());
    std::fflush(stdout);
    server.run(stop_pipe[0]);
    if (!options.log.empty()) {
        write_log(options.log, options.head, entries);
    }
    return 0;
}

}  // namespace

int main(int count, char **arguments) {
    const std::string first = count > 1 ? arguments[1] : "";
    if (first == "--help") {
        std::fputs(kUsage, stdout);
        return 0;
    }
    if (first == "--help-control") {
        std::fputs(ControlDesk::help().c_str(), stdout);
        return 0;
    }
    if (first == "--version") {
        std::printf("simrig, protocol %d\n", SIMRIG_VERSION);
        return 0;
    }
    try {
        const Options options = parse(count, arguments);
        return options.replay.empty() ? serve(options) : replay_log(options);
    } catch (const WrongUsage &error) {
        std::fprintf(stderr, "simrig: %s; see simrig --help\n", error.what());
        return 2;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "simrig: %s\n", error.what());
        return 1;
    }
}
