// SPDX-License-Identifier: Apache-2.0
// hal_log on standard error: journald's levels, and it never blocks on a reader.
#include "daemon/backends/linux/stderr_log.h"

#include <fcntl.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "linux_harness.hpp"

namespace {

// Replaces standard error by another file for a while.
struct Stderr {
    int saved = dup(2);

    explicit Stderr(int fd) { REQUIRE(dup2(fd, 2) == 2); }
    Stderr(const Stderr &) = delete;
    Stderr &operator=(const Stderr &) = delete;
    ~Stderr() {
        dup2(saved, 2);
        close(saved);
    }
};

void put(stderr_log &log, hal_log_level level, const char *text) {
    log.hal.operations->write(log.hal.self, level, text);
}

std::string drain(int fd) {
    std::string text;
    char part[4096];
    fcntl(fd, F_SETFL, O_NONBLOCK);
    for (ssize_t got; (got = read(fd, part, sizeof part)) > 0;) {
        text.append(part, static_cast<size_t>(got));
    }
    return text;
}

size_t lines_in(const std::string &text) {
    return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

// Writes until lines are lost, without ever blocking; then reads and checks the report of the loss.
void check_loss(int reader, int writer) {
    stderr_log log;
    {
        const Stderr other(writer);
        stderr_log_open(&log, HAL_LOG_INFO);
    }
    const auto begin = std::chrono::steady_clock::now();
    const std::string text(200, 'x');
    const unsigned written = 20000;
    for (unsigned i = 0; i < written; i++) {
        put(log, HAL_LOG_INFO, text.c_str());
    }
    CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(20));
    REQUIRE(log.lost > 0);
    const unsigned lost = log.lost;
    const std::string first = drain(reader);
    CHECK(lines_in(first) == written - lost);
    put(log, HAL_LOG_INFO, "after");
    CHECK(drain(reader) == "<4>" + std::to_string(lost) + " log lines were lost\n<6>after\n");
    CHECK(log.lost == 0);
    stderr_log_close(&log);
}

// A closed reader does not raise a signal.
void check_gone(int reader, int writer) {
    stderr_log log;
    {
        const Stderr other(writer);
        stderr_log_open(&log, HAL_LOG_INFO);
    }
    close(reader);
    put(log, HAL_LOG_INFO, "unseen");
    CHECK(log.lost == 1);
    stderr_log_close(&log);
    close(writer);
}

}  // namespace

TEST_CASE("a pipe gets journald levels, one line each") {
    const linux_harness::Kernel kernel;
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    stderr_log log;
    {
        const Stderr other(ends[1]);
        stderr_log_open(&log, HAL_LOG_INFO);
    }
    put(log, HAL_LOG_ERROR, "three");
    put(log, HAL_LOG_INFO, "six\nlines\x1b[2J\x7f");
    put(log, HAL_LOG_DEBUG, "not asked for");
    log.max = HAL_LOG_DEBUG;
    put(log, HAL_LOG_DEBUG, "asked for");
    CHECK(drain(ends[0]) == "<3>three\n<6>six?lines?[2J?\n<7>asked for\n");
    put(log, HAL_LOG_INFO, std::string(5000, 'y').c_str());
    CHECK(drain(ends[0]) == "<6>" + std::string(1020, 'y') + "\n");
    stderr_log_close(&log);
    close(ends[0]);
    close(ends[1]);
}

TEST_CASE("a terminal gets level words") {
    const linux_harness::Kernel kernel;
    int master = -1, slave = -1;
    REQUIRE(openpty(&master, &slave, nullptr, nullptr, nullptr) == 0);
    stderr_log log;
    {
        const Stderr other(slave);
        stderr_log_open(&log, HAL_LOG_INFO);
    }
    put(log, HAL_LOG_WARNING, "careful");
    put(log, HAL_LOG_NOTICE, "so so");
    CHECK(drain(master) == "warning: careful\r\nso so\r\n");
    // Stopped by Ctrl-S: lines are lost, nothing blocks.
    CHECK(tcflow(slave, TCOOFF) == 0);
    for (int i = 0; i < 100; i++) {
        put(log, HAL_LOG_INFO, "stopped");
    }
    CHECK(tcflow(slave, TCOON) == 0);
    stderr_log_close(&log);
    close(master);
    close(slave);
}

TEST_CASE("a pipe or socket that is not read loses lines and does not block") {
    const linux_harness::Kernel kernel;
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    check_loss(ends[0], ends[1]);
    check_gone(ends[0], ends[1]);
    REQUIRE(socketpair(AF_UNIX, SOCK_STREAM, 0, ends) == 0);
    check_loss(ends[0], ends[1]);
    check_gone(ends[0], ends[1]);
}
