// SPDX-License-Identifier: Apache-2.0
// simrig: the simulated rig as a process. See server/options.cpp and README.md.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "tools/simrig/rig/rig.hpp"
#include "tools/simrig/server/options.hpp"
#include "tools/simrig/server/pty.hpp"
#include "tools/simrig/server/server.hpp"
#include "tools/simrig/server/staging.hpp"
#include "tools/simrig/server/view.hpp"
#include "tools/simrig/streams.hpp"
#include "tools/simrig/wire/message.hpp"
#include "tools/simrig/world/document.hpp"

namespace {

using namespace simrig;

constexpr size_t kLongestScript = size_t(1) << 20;

/// A file that the user named cannot be used.
struct BadInput : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Runs `what`; its exceptions become BadInput.
template <typename Read>
auto reading(Read read) -> decltype(read()) {
    try {
        return read();
    } catch (const std::runtime_error &error) {
        throw BadInput(error.what());
    }
}

/// A progress bar on standard error, if that is a terminal.
class Progress {
  public:
    ~Progress() { wipe(); }
    void show(int done, int total, const char *what) {
        if (isatty(STDERR_FILENO) == 0) {
            return;
        }
        const int width = 30, full = width * done / total;
        std::fprintf(stderr, "\r\033[K[%.*s%.*s] %s", full, "##############################",
                     width - full, "..............................", what);
        drawn_ = true;
    }
    void wipe() {
        if (drawn_) {
            std::fputs("\r\033[K", stderr);
        }
        drawn_ = false;
    }

  private:
    bool drawn_ = false;
};

int stop_pipe[2];
volatile sig_atomic_t is_preparing;
char listening_path[sizeof(sockaddr_un::sun_path)];  ///< "": none

void stop(int) {
    if (is_preparing) {
        // Nothing looks at the pipe yet.
        unlink(listening_path);
        _exit(0);
    }
    const char byte = 0;
    // The pipe is full only when enough wake-ups are pending.
    if (write(stop_pipe[1], &byte, 1) < 0) {
        return;
    }
}

void catch_signals() {
    if (pipe2(stop_pipe, O_CLOEXEC | O_NONBLOCK) != 0) {
        throw std::runtime_error("cannot create a pipe");
    }
    struct sigaction action {};
    action.sa_handler = stop;
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    signal(SIGPIPE, SIG_IGN);
}

/// Time since the first call.
WallClock wall_clock() {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> begin;
    return [begin]() mutable {
        const Clock::time_point now = Clock::now();
        begin = begin ? begin : now;
        return std::chrono::duration<double, std::micro>(now - *begin).count();
    };
}

/// How to build the rig, and the past to replay on it.
struct Plan {
    LogHead head;  ///< names as given on the command line or in the log
    std::string rig_path, scene_path;
    std::shared_ptr<world::Scene> scene;
    std::vector<LogEntry> past;
};

void check_sum(const std::string &path, uint32_t sum, uint32_t then, const std::string &log) {
    if (sum != then) {
        throw BadInput(path + " has changed since " + log + " was recorded");
    }
}

Plan plan_of(const Options &options) {
    Plan plan;
    plan.head.seed = options.seed;
    plan.head.begin_s = options.begin_s;
    plan.head.every_clock = options.every_clock;
    const std::string log = options.replay + options.from;
    if (!log.empty()) {
        Log read = reading([&log] { return read_log(log); });
        plan.head = read.head;
        plan.past = std::move(read.entries);
    }
    const LogHead then = plan.head;
    if (!options.scene.empty()) {
        plan.head.scene = options.scene;
    }
    if (!options.rig.empty() || plan.head.rig.empty()) {
        plan.head.rig = options.rig.empty() ? "default" : options.rig;
    }
    reading([&plan] {
        plan.rig_path = place_of("rigs", plan.head.rig);
        plan.scene_path = place_of("scenes", plan.head.scene);
        plan.head.rig_sum = sum_of(description_at(plan.rig_path));
        plan.head.scene_sum = sum_of(description_at(plan.scene_path));
    });
    if (!log.empty()) {
        check_sum(plan.rig_path, plan.head.rig_sum, then.rig_sum, log);
        check_sum(plan.scene_path, plan.head.scene_sum, then.scene_sum, log);
    }
    reading([&plan] {
        // Quick, so a mistake in these files is reported before the slow steps.
        world::load_rig(plan.rig_path);
        load_settings(plan.rig_path);
    });
    return plan;
}

void prepare_scene(Plan *plan) {
    Progress progress;
    progress.show(0, 1, "computing the scene's light");
    reading([plan] {
        plan->scene = std::make_shared<world::Scene>(world::load_scene(plan->scene_path));
    });
}

std::unique_ptr<Session> session_of(const Options &options, const Plan &plan) {
    LogHead head = plan.head;
    head.rig = plan.rig_path;
    head.scene = plan.scene_path;
    return reading([&] {
        return std::make_unique<Session>([head, scene = plan.scene, &options] {
            return std::make_unique<Setup>(head, scene, options.threads, options.files,
                                           options.wall ? wall_clock() : WallClock());
        });
    });
}

int replay_log(const Options &options) {
    Plan plan = plan_of(options);
    prepare_scene(&plan);
    const std::unique_ptr<Session> session = session_of(options, plan);
    session->replay(plan.past, std::numeric_limits<double>::infinity());
    std::printf("%zu entries, all answered as in the log\n", plan.past.size());
    return 0;
}

void run_script(Session &session, const std::string &path) {
    const Body bytes = reading([&path] { return whole_file(path, kLongestScript); });
    std::istringstream lines(std::string(bytes.begin(), bytes.end()));
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        number++;
        const Words words = words_of(line);
        if (words.empty() || words[0][0] == '#') {
            continue;
        }
        const std::optional<Body> answer =
            session.begin(SIMRIG_CONTROL, Body(line.begin(), line.end()), SIMRIG_ROLE_CONTROL);
        const size_t status_bytes = sizeof(int32_t);
        if (answer && (*answer)[0] != SIMRIG_OK) {
            throw BadInput(path + ":" + std::to_string(number) + ": " +
                           std::string(answer->begin() + status_bytes, answer->end()));
        }
    }
}

void write_views(const Options &options, const Plan &plan) {
    std::error_code failure;
    std::filesystem::create_directories(options.view, failure);
    if (failure) {
        throw std::runtime_error("cannot create " + options.view + ": " + failure.message());
    }
    const world::Rig rig = reading([&plan] { return world::load_rig(plan.rig_path); });
    View view = view_at(rig, options.zoom, options.focus_mm);
    view.seed = options.seed;
    view.threads = options.threads;
    const std::string prefix = options.view + "/";
    Progress progress;
    write_view(*plan.scene, rig, view, prefix,
               [&progress](int done) { progress.show(done, kViewFiles, "what the cameras see"); });
    progress.wipe();
    std::printf("%sleft.png\n%sright.png\n%srig.svg\n", prefix.c_str(), prefix.c_str(),
                prefix.c_str());
}

/// The text with each ADDRESS replaced by the listener's name.
std::string hint_of(std::string text, const std::string &name) {
    const std::string word = "ADDRESS";
    for (size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += name.size()) {
        text.replace(at, word.size(), name);
    }
    return text.empty() ? text : text + "\n";
}

void must_be_received() {
    if (std::fflush(stdout) != 0) {
        throw std::runtime_error(std::string("cannot write standard output: ") +
                                 std::strerror(errno));
    }
}

/// Listens before the scene is prepared: a program that was started together with this one connects
/// at once, and is answered when the rig is ready.
std::unique_ptr<Listener> listen_early(const Options &options) {
    auto listener = std::make_unique<Listener>(options.listen);
    const std::string &path = listener->path();
    std::memcpy(listening_path, path.c_str(), path.size() + 1);
    is_preparing = 1;
    catch_signals();
    return listener;
}

int serve(const Options &options, const Plan &plan, Listener &listener) {
    const std::unique_ptr<Session> session = session_of(options, plan);
    if (!options.log.empty()) {
        session->log_to(options.log, plan.head);
    }
    session->replay(plan.past, options.until_s >= 0 ? options.until_s * 1e6
                                                    : std::numeric_limits<double>::infinity());
    if (!options.script.empty()) {
        run_script(*session, options.script);
    }
    std::unique_ptr<Pty> pty;
    std::function<void()> tick;
    if (options.pty) {
        pty = std::make_unique<Pty>();
        std::printf("lens controller on %s\n", pty->name().c_str());
        tick = [&pty, &session] { pty->exchange(session->serial(), session->board().now_ps()); };
    }
    Server server(listener, *session, plan.head.rig, tick);
    std::printf("listening on %s\n%s", listener.name().c_str(),
                hint_of(options.hint, listener.name()).c_str());
    must_be_received();
    is_preparing = 0;
    server.run(stop_pipe[0]);
    return session->log_failed() ? 1 : 0;
}

int run(const Options &options) {
    if (options.help || options.help_control) {
        std::fputs(options.help ? kUsage : ControlServer::help().c_str(), stdout);
        return 0;
    }
    if (options.version) {
        std::printf("simrig %s, protocol %d\n", SIMRIG_RELEASE, SIMRIG_VERSION);
        return 0;
    }
    if (!options.replay.empty()) {
        return replay_log(options);
    }
    Plan plan = plan_of(options);
    std::unique_ptr<Listener> listener = options.listen.empty() ? nullptr : listen_early(options);
    prepare_scene(&plan);
    if (!options.view.empty()) {
        write_views(options, plan);
    }
    return listener ? serve(options, plan, *listener) : 0;
}

int complain(const std::string &what, int code) {
    std::fprintf(stderr, "simrig: %s\n", one_line(what).c_str());
    return code;
}

}  // namespace

int main(int count, char **arguments) {
    if (!occupy_standard_streams()) {
        return 1;
    }
    try {
        const int code = run(parse_options(count, arguments));
        must_be_received();
        return code;
    } catch (const WrongUsage &error) {
        return complain(std::string(error.what()) + "; see simrig --help", 2);
    } catch (const BadInput &error) {
        return complain(error.what(), 3);
    } catch (const std::exception &error) {
        return complain(error.what(), 1);
    }
}
