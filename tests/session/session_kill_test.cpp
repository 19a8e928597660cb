// SPDX-License-Identifier: Apache-2.0
// Recordings that are killed at every system call (also in the middle of a write), that lose power
// there, or that get an error from every call: the directory stays readable and contains everything
// that was reported as written.
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <filesystem>
#include <fstream>

#include "daemon/session/record.h"
#include "power_loss.hpp"
#include "scratch.hpp"
#include "session_harness.hpp"
#include "synthetic/seed.hpp"

using namespace session_harness;

namespace {

/// What happens at the call with this number, counted from 1; 0: nothing.
struct fate {
    long at = 0;
    bool killed = false;  // else it fails
    int error = 0;
    bool for_ever = false;  // all later calls fail too
    bool power = false;     // a kill also loses everything that was not synced
};
fate coming;
long calls;
power_loss disk;

/// Whether this call fails; does not return if the process is killed here.
bool strikes() {
    calls++;
    const bool now =
        coming.at != 0 && (calls == coming.at || (coming.for_ever && calls > coming.at));
    if (now && coming.killed) {
        if (coming.power) {
            coming = {};  // calls from here on are not the recording's
            disk.strike();
        }
        raise(SIGKILL);
    }
    errno = now ? coming.error : errno;
    return now;
}

}  // namespace

extern "C" {
int __real_openat(int directory, const char *path, int flags, mode_t mode);
int __real_mkdirat(int directory, const char *path, mode_t mode);
ssize_t __real_write(int file, const void *data, size_t bytes);
int __real_ftruncate(int file, off_t length);
off_t __real_lseek(int file, off_t offset, int whence);
int __real_fsync(int file);
int __real_close(int file);
int __real_renameat(int from, const char *old_path, int to, const char *new_path);
int __real_unlinkat(int directory, const char *path, int flags);

int __wrap_openat(int directory, const char *path, int flags, ...) {
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    if (strikes()) {
        return -1;
    }
    const bool was_there = faccessat(directory, path, F_OK, 0) == 0;
    const int file = __real_openat(directory, path, flags, mode);
    if (file >= 0 && (flags & O_CREAT) != 0) {
        disk.opened(power_loss::of(file), !was_there);
    }
    return file;
}

int __wrap_mkdirat(int directory, const char *path, mode_t mode) {
    const int code = strikes() ? -1 : __real_mkdirat(directory, path, mode);
    if (code == 0) {
        disk.made_directory(power_loss::of(directory, path));
    }
    return code;
}

// A write that is hit has written half of its bytes.
ssize_t __wrap_write(int file, const void *data, size_t bytes) {
    if (coming.at != 0 && calls + 1 == coming.at && bytes > 1) {
        __real_write(file, data, bytes / 2);
    }
    return strikes() ? -1 : __real_write(file, data, bytes);
}

int __wrap_ftruncate(int file, off_t length) {
    const int code = strikes() ? -1 : __real_ftruncate(file, length);
    if (code == 0) {
        disk.cut(power_loss::of(file), std::uintmax_t(length));
    }
    return code;
}

off_t __wrap_lseek(int file, off_t offset, int whence) {
    return strikes() ? -1 : __real_lseek(file, offset, whence);
}

int __wrap_fsync(int file) {
    const int code = strikes() ? -1 : __real_fsync(file);
    if (code == 0) {
        disk.synced(file);
    }
    return code;
}

int __wrap_close(int file) {
    const bool struck = strikes();
    const int code = __real_close(file);
    return struck ? -1 : code;
}

int __wrap_renameat(int from, const char *old_path, int to, const char *new_path) {
    const int code = strikes() ? -1 : __real_renameat(from, old_path, to, new_path);
    if (code == 0) {
        disk.renamed(power_loss::of(from, old_path), power_loss::of(to, new_path));
    }
    return code;
}

int __wrap_unlinkat(int directory, const char *path, int flags) {
    const int code = strikes() ? -1 : __real_unlinkat(directory, path, flags);
    if (code == 0) {
        disk.removed(power_loss::of(directory, path));
    }
    return code;
}
}

namespace {

constexpr int kPairs = 4;

struct recording {
    owned_pair pairs[kPairs];
    recording() {
        Random random(synthetic::test_seed());
        for (owned_pair &made : pairs) {
            random_pair(random, made);
        }
    }
};

/// Records all pairs and reports each written one by its number to the descriptor `reported`.
/// Returns 0 or the first error.
int record_pairs(const recording &what, const std::string &path, int reported) {
    auto writer = new_writer();
    message last_error{};
    int first =
        session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig", "now", &last_error);
    if (first != 0) {
        CHECK(last_error.text[0] != '\0');
        return first;
    }
    for (int i = 0; i < kPairs; i++) {
        const std::uint16_t values[] = {0x5b1d, static_cast<std::uint16_t>(i)};
        int code =
            session_writer_registers(writer.get(), "FPGA bridge", 1, 0, values, 2, &last_error);
        if (code == 0) {
            code = session_writer_pair(writer.get(), &what.pairs[i].value, &last_error);
        }
        if (code == 0) {
            const char number = static_cast<char>(i);
            __real_write(reported, &number, 1);
        }
        first = first != 0 ? first : code;
    }
    const int code = session_writer_end(writer.get(), &last_error);
    return first != 0 ? first : code;
}

/// Reads the session: its pairs must be those reported in `reported`, plus possibly one if a kill
/// came between its line and the report, or if the line could not be removed.
void check_what_is_left(const recording &what, const std::string &path, const std::string &reported,
                        bool one_more) {
    session_reader reader;
    auto event = std::make_unique<session_event>();
    message last_error{};
    const int code = session_reader_open(&reader, AT_FDCWD, path.c_str(), nullptr, &last_error);
    if (code != 0) {
        CHECK((code == ERROR_MISSING || code == ERROR_ARGUMENT));
        CHECK(reported.empty());
        return;
    }
    std::size_t found = 0;
    int got;
    while ((got = session_reader_next(&reader, event.get(), &last_error)) == 1) {
        if (event->kind != SESSION_PAIR) {
            continue;
        }
        const int number = found < reported.size() ? reported[found] : int(found);
        CHECK((found < reported.size() || (one_more && found == reported.size())));
        CHECK(same_pair(reader, *event, what.pairs[number].value));
        found++;
        CHECK(event->pair.number == found);
    }
    INFO(std::string(last_error.text));
    CHECK(got == 0);
    CHECK(found >= reported.size());
    session_reader_close(&reader);
}

/// Runs the recording in its own process; its reports go to `reported`. -1: it was killed.
int run(const recording &what, const std::string &path, const fate &fate, std::string *reported) {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        calls = 0;
        coming = fate;
        disk = {};
        const int code = record_pairs(what, path, ends[1]);
        _exit(code == 0 ? 0 : 1);
    }
    __real_close(ends[1]);
    char number;
    reported->clear();
    while (read(ends[0], &number, 1) == 1) {
        *reported += number;
    }
    __real_close(ends[0]);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return WIFSIGNALED(status) ? -1 : WEXITSTATUS(status);
}

long count_calls(const recording &what) {
    const scratch folder;
    calls = 0;
    coming = {};
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    REQUIRE(record_pairs(what, folder / "session", ends[1]) == 0);
    const long count = calls;
    __real_close(ends[0]);
    __real_close(ends[1]);
    return count;
}

}  // namespace

TEST_CASE("a kill at every call loses no reported pair") {
    const recording what;
    const long count = count_calls(what);
    CHECK(count > 60);
    for (long at = 1; at <= count; at++) {
        const scratch folder;
        std::string reported;
        INFO("call ", at);
        REQUIRE(run(what, folder / "session", {at, true, 0, false, false}, &reported) == -1);
        check_what_is_left(what, folder / "session", reported, true);
    }
}

TEST_CASE("a power loss at every call loses no reported pair") {
    const recording what;
    const long count = count_calls(what);
    for (long at = 1; at <= count; at++) {
        const scratch folder;
        std::string reported;
        INFO("call ", at);
        REQUIRE(run(what, folder / "session", {at, true, 0, false, true}, &reported) == -1);
        check_what_is_left(what, folder / "session", reported, true);
    }
}

TEST_CASE("a disk without sync is accepted, one whose sync fails is not") {
    const recording what;
    const long count = count_calls(what);
    long spared_by_EINVAL = 0, spared_by_EIO = 0;
    for (const int error : {EINVAL, EIO}) {
        long &spared = error == EINVAL ? spared_by_EINVAL : spared_by_EIO;
        for (long at = 1; at <= count; at++) {
            const scratch folder;
            std::string reported;
            INFO("call ", at, ", error ", error);
            coming = {};
            spared +=
                run(what, folder / "session", {at, false, error, false, false}, &reported) == 0;
        }
    }
    // Syncs of directories (the session's own for its index and each frame, and its parent's) and
    // of the frames' files; those of the index are never spared.
    CHECK(spared_by_EINVAL == spared_by_EIO + 1 + 2 * 2 * kPairs + 1);
    // Closed files are already synced.
    CHECK(spared_by_EIO == 3);
}

TEST_CASE("an error from every call, once or persistent") {
    const recording what;
    const long count = count_calls(what);
    for (const int error : {ENOSPC, EIO}) {
        for (const bool for_ever : {false, true}) {
            for (long at = 1; at <= count; at++) {
                const scratch folder;
                std::string reported;
                INFO("call ", at, ", error ", error, ", for ever ", for_ever);
                const int code =
                    run(what, folder / "session", {at, false, error, for_ever, false}, &reported);
                REQUIRE(code >= 0);
                check_what_is_left(what, folder / "session", reported, for_ever);
                // A single failure loses at most the pair that was being written.
                if (!for_ever && std::filesystem::exists(folder / "session/session.index")) {
                    CHECK(reported.size() >= kPairs - 1);
                }
            }
        }
    }
}

namespace {

std::uint64_t no_time(void *) {
    return 0;
}

void no_wait(void *, std::uint64_t) {}

std::ptrdiff_t open_files() {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return std::distance(begin(all), end(all));
}

/// A recorder of an instrument that has only a clock, which never advances.
struct still_recorder {
    hal_clock_operations still = {no_time, no_wait, nullptr};
    hal_clock clock = {&still, nullptr};
    rig_ports outer{};
    std::unique_ptr<record> recorder = std::make_unique<record>();

    still_recorder() {
        rig_ports inner{};
        inner.clock = &clock;
        record_init(recorder.get(), &inner, &outer);
    }
};

/// Begins a session and its recording, and removes them on failure.
int begin_recording(record &recorder, session_writer &writer, const std::string &path,
                    const fate &fate) {
    message last_error{};
    coming = {};
    REQUIRE(session_writer_begin(&writer, AT_FDCWD, path.c_str(), "v1", "rig", "now",
                                 &last_error) == 0);
    calls = 0;
    coming = fate;
    const int code = record_start(&recorder, &writer, &last_error);
    coming = {};
    if (code != 0) {
        CHECK(std::string(last_error.text).find("calls.log: cannot be written") !=
              std::string::npos);
        session_writer_discard(&writer, AT_FDCWD);
    }
    return code;
}

}  // namespace

TEST_CASE("a recording that fails to begin leaves nothing behind, and the next one works") {
    const still_recorder still;
    record *const recorder = still.recorder.get();
    auto writer = new_writer();
    message last_error{};
    const std::ptrdiff_t open_before = open_files();
    int failures = 0;
    for (long at = 1;; at++) {
        const scratch folder;
        const std::string path = folder / "session";
        INFO("call ", at);
        const int code = begin_recording(*recorder, *writer, path, {at, false, ENOSPC, false});
        if (code == 0) {
            CHECK(record_stop(recorder, &last_error) == 0);
            CHECK(session_writer_end(writer.get(), &last_error) == 0);
            break;
        }
        failures++;
        CHECK(code == ERROR_FULL);
        CHECK(!std::filesystem::exists(path));
        CHECK(open_files() == open_before);
        REQUIRE(begin_recording(*recorder, *writer, path, {}) == 0);
        CHECK(record_stop(recorder, &last_error) == 0);
        CHECK(session_writer_end(writer.get(), &last_error) == 0);
    }
    CHECK(failures >= 3);  // opening, writing, syncing
    CHECK(open_files() == open_before);
}

TEST_CASE("a recording does not use an existing file") {
    const still_recorder still;
    record *const recorder = still.recorder.get();
    auto writer = new_writer();
    const scratch folder;
    const std::string path = folder / "session";
    std::filesystem::create_directory(path);
    std::ofstream(path + "/calls.log") << "mine";
    CHECK(begin_recording(*recorder, *writer, path, {}) == ERROR_IO);
    std::string kept;
    std::getline(std::ifstream(path + "/calls.log"), kept);
    CHECK(kept == "mine");
}
