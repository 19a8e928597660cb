// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdio>

#include "daemon/cli/options.h"
#include "tools/host/commands/commands.hpp"

#ifdef VERGENCE_HAS_VIEW
#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <memory>
#include <string>

#include "daemon/session/session_pairs.h"
#include "tools/host/view/view_results.hpp"
#include "tools/host/view/view_server.hpp"
#include "tools/host/view/view_source.hpp"
#include "tools/host/view/view_webcams.hpp"
#endif

namespace {

struct request {
    const char *token, *cameras, *calibration;
    const char *out;
    double near_mm, far_mm;
    int port;
    bool no_browser;
};

const command_argument options[] = {
    text_option(
        "cameras", offsetof(request, cameras), "LEFT,RIGHT",
        "Devices of two webcams, /dev/video0,/dev/video2: starts vergenced on them with the "
        "profile two-cameras, and ends it. Without ADDRESS and a running vergenced the first "
        "two webcams are taken."),
    text_option("calibration", offsetof(request, calibration), "FILE",
                "Calibration of a session, in place of its own."),
    number_option("near", COMMAND_NUMBER, offsetof(request, near_mm), "MM",
                  "Nearest depth. Default: that of the calibration.", 1, 1e7, 0, 0, "mm"),
    number_option("far", COMMAND_NUMBER, offsetof(request, far_mm), "MM",
                  "Farthest depth; required with --near.", 1, 1e7, 0, 0, "mm"),
    text_option("out", offsetof(request, out), "DIR",
                "Directory for captures, surfaces and what webcams keep; created if missing. "
                "Default: vergence-view, once something is written."),
    number_option("port", COMMAND_INTEGER, offsetof(request, port), "N",
                  "Port on 127.0.0.1. Default: any free one.", 1024, 65535, 1, 0),
    text_option("token", offsetof(request, token), "FILE",
                "File with the token for tcp:HOST:PORT, if not the default one."),
    flag_option("no-browser", offsetof(request, no_browser), "Only print the address of the page."),
};

const option_page page = {
    "vergence view",
    "[ADDRESS|SESSION]",
    "show live in the browser what the cameras see, with depth",
    "Serves a page on this machine and opens it: both cameras live, with focus peaking, clipped "
    "pixels, histogram and rows; depth live, if there is a calibration; and controls that send the "
    "console's commands and show each. ADDRESS is an instrument's, as for \"vergence --connect\"; "
    "SESSION a recorded session, whose pairs are shown. Without either: this user's vergenced, "
    "else "
    "the system's, else two webcams. Only this machine's user who knows the printed address can "
    "use "
    "the page. Ctrl-C ends it. One picture of both cameras as a file: \"vergence --connect view\".",
    "vergence view\n"
    "vergence view unix:rig.sock --no-browser\n"
    "vergence view --cameras /dev/video0,/dev/video2\n"
    "vergence view files/scene --near 500 --far 4000",
    options,
    sizeof options / sizeof options[0],
    0,
    1};

#ifdef VERGENCE_HAS_VIEW

int fail(const std::string &error, int code) {
    std::fprintf(stderr, "vergence view: %s\n", error.c_str());
    return code;
}

std::string out_of(const request &asked) {
    return asked.out != nullptr ? asked.out : "vergence-view";
}

/// The first two webcams: the even ones of each have pictures, the odd ones data about them.
bool find_cameras(std::string *left, std::string *right) {
    constexpr int devices_max = 16;
    for (int i = 0; i < devices_max && right->empty(); i += 2) {
        const std::string path = "/dev/video" + std::to_string(i);
        if (access(path.c_str(), R_OK | W_OK) == 0) {
            (left->empty() ? left : right)->assign(path);
        }
    }
    return !right->empty();
}

/// Starts vergenced on two webcams and brings them up. Null with one sentence.
std::unique_ptr<view_source> open_webcams(const request &asked, view_webcams *webcams,
                                          std::string *error) {
    const std::string words = asked.cameras != nullptr ? asked.cameras : "";
    const std::size_t comma = words.find(',');
    std::string left = words.substr(0, comma);
    std::string right = comma != std::string::npos ? words.substr(comma + 1) : "";
    if (asked.cameras != nullptr && (left.empty() || right.empty())) {
        *error = "--cameras: two devices, as in /dev/video0,/dev/video2, are expected";
        return nullptr;
    }
    if (right.empty() && !find_cameras(&left, &right)) {
        *error =
            "no vergenced runs and there are no two webcams (give an ADDRESS, a SESSION, or "
            "--cameras LEFT,RIGHT)";
        return nullptr;
    }
    static const char *const places[] = {"vergenced", "../daemon/vergenced"};
    const std::string program = view_program(places, 2);
    if (program.empty()) {
        *error = "the program vergenced is not next to this one";
        return nullptr;
    }
    if (!view_results_make_folder(out_of(asked), error)) {
        return nullptr;
    }
    if (!webcams->start(program, left, right, out_of(asked), error)) {
        return nullptr;
    }
    auto source = view_instrument_open(webcams->address().c_str(), nullptr, error);
    if (source != nullptr) {
        // A camera that is missing is shown by the page, which can bring up again.
        source->run("bringup", [](const std::string &) { return true; });
    }
    return source;
}

std::unique_ptr<view_source> open_source(const request &asked, const char *where,
                                         view_webcams *webcams, std::string *error) {
    if (where != nullptr && session_pairs_here(where)) {
        return view_session_open(where, asked.calibration, error);
    }
    if (where != nullptr && std::strchr(where, ':') == nullptr) {
        *error = std::string(where) + ": ";
        *error += access(where, R_OK) != 0 && errno == EACCES
                      ? std::strerror(errno)
                      : "neither a recorded session nor an address (unix:PATH, tcp:HOST:PORT, "
                        "serial:DEVICE)";
        return nullptr;
    }
    if (where != nullptr) {
        return view_instrument_open(where, asked.token, error);
    }
    auto source =
        asked.cameras == nullptr ? view_instrument_open(nullptr, asked.token, error) : nullptr;
    return source != nullptr ? std::move(source) : open_webcams(asked, webcams, error);
}

/// Opens the page; the browser keeps neither our signals nor our terminal.
void open_browser(const std::string &address) {
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t none;
    sigemptyset(&none);
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
    for (int fd = 0; fd <= 2; fd++) {
        posix_spawn_file_actions_addopen(&files, fd, "/dev/null", O_RDWR, 0);
    }
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSID);
    std::string program = "xdg-open";
    std::string argument = address;
    char *words[] = {&program[0], &argument[0], nullptr};
    if (posix_spawnp(nullptr, words[0], &files, &attributes, words, environ) != 0) {
        std::fputs("vergence view: there is no xdg-open: open the address in a browser\n", stderr);
    }
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
}

int show(const request &asked, const char *where) {
    sigset_t ends;
    sigemptyset(&ends);
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        sigaddset(&ends, number);
    }
    sigprocmask(SIG_BLOCK, &ends, nullptr);  // threads inherit it
    signal(SIGPIPE, SIG_IGN);
    std::string error;
    if (asked.out != nullptr && !view_results_make_folder(asked.out, &error)) {
        return fail(error, CLIENT_FAILED);
    }
    view_webcams webcams;
    const std::unique_ptr<view_source> source = open_source(asked, where, &webcams, &error);
    if (source == nullptr) {
        return fail(error, CLIENT_BAD_INPUT);
    }
    view_settings settings;
    settings.title =
        "Vergence: " + (webcams.cameras().empty() ? source->name() : webcams.cameras());
    settings.port = asked.port;
    settings.out = out_of(asked);
    settings.calibration = asked.calibration != nullptr ? asked.calibration : "";
    settings.near_mm = asked.near_mm;
    settings.far_mm = asked.far_mm;
    view_server server;
    if (!server.start(source.get(), settings, &error)) {
        return fail(error, CLIENT_FAILED);
    }
    std::printf("%s\n", server.address().c_str());
    std::fflush(stdout);
    if (!asked.no_browser) {
        open_browser(server.address());
    }
    int number = 0;
    sigwait(&ends, &number);
    return CLIENT_OK;
}

#else

int show(const request &, const char *) {
    std::fputs(
        "vergence view: this build has no web server: install libcivetweb-dev and build again\n",
        stderr);
    return CLIENT_FAILED;
}

#endif

}  // namespace

int command_view(int argc, char **argv) {
    request asked{};
    const char *where = nullptr;
    int count = 0;
    const int parsed = options_parse(&page, argc, argv, &asked, &where, &count);
    if (parsed != OPTIONS_CONTINUE) {
        return parsed;
    }
    if ((asked.near_mm > 0) != (asked.far_mm > 0) || asked.near_mm > asked.far_mm) {
        std::fputs("vergence view: --near and --far belong together, the nearer one first\n",
                   stderr);
        return CLIENT_USAGE;
    }
    if (asked.cameras != nullptr && count > 0) {
        std::fputs("vergence view: --cameras cannot be combined with an ADDRESS or a SESSION\n",
                   stderr);
        return CLIENT_USAGE;
    }
    return show(asked, count > 0 ? where : nullptr);
}
