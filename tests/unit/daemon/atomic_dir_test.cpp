// SPDX-License-Identifier: Apache-2.0
// A directory of results appears whole or not at all.
#include "daemon/files/atomic_dir.h"

#include <doctest/doctest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <utime.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "core/error.h"
#include "scratch.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace fs = std::filesystem;

namespace {

int umasks = 0;  // calls of umask

const char *const names[] = {"a.txt", "b.txt", "end.txt"};

std::set<std::string> listing(const fs::path &path) {
    std::set<std::string> result;
    for (const fs::directory_entry &entry : fs::directory_iterator(path)) {
        result.insert(entry.path().filename().string());
    }
    return result;
}

std::string contents(const fs::path &path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

void put(const std::string &path, const char *text) {
    std::ofstream(path) << text;
}

void put_work(const atomic_dir &directory, const char *name, const char *text) {
    char path[ATOMIC_DIR_PATH_BYTES];
    atomic_dir_file_path(&directory, name, path);
    put(path, text);
}

}  // namespace

/// Replaces the C library's: a call changes the umask of all threads.
extern "C" mode_t umask(mode_t mask) noexcept {
    umasks++;
    return static_cast<mode_t>(syscall(SYS_umask, mask));
}

TEST_CASE("permissions follow the umask, which is not changed for other threads") {
    const mode_t before = umask(0027);
    const scratch place;
    const int asked = umasks;
    atomic_dir directory;
    message text;
    REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), &text) == ERROR_OK);
    put_work(directory, "end.txt", "1");
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    std::string why;
    REQUIRE(whole_file_write(place / "whole.txt", "2", &why));
    CHECK(umasks == asked);
    struct stat status = {};
    REQUIRE(stat((place / "out").c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0750);
    REQUIRE(stat((place / "whole.txt").c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0640);
    umask(before);
}

TEST_CASE("two runs in one place do not interfere") {
    const scratch place;
    atomic_dir first, second;
    message text;
    REQUIRE(atomic_dir_begin(&first, (place / "one").c_str(), &text) == ERROR_OK);
    REQUIRE(atomic_dir_begin(&second, (place / "two").c_str(), &text) == ERROR_OK);
    put_work(first, "end.txt", "1");
    put_work(second, "end.txt", "2");
    REQUIRE(atomic_dir_commit(&first, names, 3, "end.txt", &text) == ERROR_OK);
    REQUIRE(atomic_dir_commit(&second, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(contents(place / "one/end.txt") == "1");
    CHECK(contents(place / "two/end.txt") == "2");
}

TEST_CASE("a new directory appears whole") {
    const scratch place;
    atomic_dir directory;
    message text;
    REQUIRE(atomic_dir_begin(&directory, (place / "out/").c_str(), &text) == ERROR_OK);
    put_work(directory, "a.txt", "1");
    put_work(directory, "end.txt", "2");
    CHECK_FALSE(fs::exists(place / "out"));
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(listing(place.path) == std::set<std::string>{"out"});
    CHECK(listing(place / "out") == std::set<std::string>{"a.txt", "end.txt"});
    struct stat status;
    REQUIRE(stat((place / "out").c_str(), &status) == 0);
    const mode_t mask = umask(0);
    umask(mask);
    CHECK((status.st_mode & 0777) == (0777 & ~mask));
    atomic_dir_abort(&directory);
    CHECK(fs::exists(place / "out/end.txt"));
}

TEST_CASE("missing parents are created and, after a failure, removed") {
    const scratch place;
    atomic_dir directory;
    message text;
    REQUIRE(atomic_dir_begin(&directory, (place / "x/y/out").c_str(), &text) == ERROR_OK);
    put_work(directory, "a.txt", "1");
    atomic_dir_abort(&directory);
    CHECK(listing(place.path).empty());
    REQUIRE(atomic_dir_begin(&directory, (place / "x/y/out").c_str(), &text) == ERROR_OK);
    put_work(directory, "end.txt", "1");
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(fs::exists(place / "x/y/out/end.txt"));
}

TEST_CASE("an earlier set is replaced, other files stay") {
    const scratch place;
    fs::create_directory(place / "out");
    for (const char *name : {"out/a.txt", "out/b.txt", "out/end.txt", "out/mine.txt"}) {
        put(place / name, "old");
    }
    atomic_dir directory;
    message text;
    REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), &text) == ERROR_OK);
    put_work(directory, "a.txt", "new");
    put_work(directory, "end.txt", "new");
    CHECK(contents(place / "out/a.txt") == "old");
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(listing(place / "out") == std::set<std::string>{"a.txt", "end.txt", "mine.txt"});
    CHECK(contents(place / "out/a.txt") == "new");
    CHECK(contents(place / "out/mine.txt") == "old");
}

TEST_CASE("a failure leaves the earlier set unchanged") {
    for (const bool pipe : {false, true}) {
        const scratch place;
        fs::create_directories(place / "out");
        if (pipe) {
            REQUIRE(mkfifo((place / "out/b.txt").c_str(), 0600) == 0);
        } else {
            fs::create_directories(place / "out/b.txt");  // a directory where a file belongs
        }
        put(place / "out/a.txt", "old");
        put(place / "out/end.txt", "old");
        atomic_dir directory;
        message text;
        REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), &text) == ERROR_OK);
        for (const char *name : names) {
            put_work(directory, name, "new");
        }
        CHECK(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_BUFFER);
        const std::string why = text.text;
        CHECK(why.find(place / "out/b.txt") != std::string::npos);
        CHECK(why.find(pipe ? "file" : "directory") != std::string::npos);
        CHECK(contents(place / "out/a.txt") == "old");
        CHECK(contents(place / "out/end.txt") == "old");
        CHECK(fs::is_fifo(place / "out/b.txt") == pipe);
        CHECK(listing(place / "out") == std::set<std::string>{"a.txt", "b.txt", "end.txt"});
    }
}

TEST_CASE("of two simultaneous runs the later one's set remains, whole") {
    const scratch place;
    atomic_dir first, second;
    message text;
    REQUIRE(atomic_dir_begin(&first, (place / "out").c_str(), &text) == ERROR_OK);
    REQUIRE(atomic_dir_begin(&second, (place / "out").c_str(), &text) == ERROR_OK);
    put_work(first, "a.txt", "first");
    put_work(first, "b.txt", "first");
    put_work(first, "end.txt", "first");
    put_work(second, "a.txt", "second");
    put_work(second, "end.txt", "second");
    REQUIRE(atomic_dir_commit(&first, names, 3, "end.txt", &text) == ERROR_OK);
    REQUIRE(atomic_dir_commit(&second, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(listing(place.path) == std::set<std::string>{"out"});
    CHECK(listing(place / "out") == std::set<std::string>{"a.txt", "end.txt"});
    CHECK(contents(place / "out/a.txt") == "second");
    CHECK(contents(place / "out/end.txt") == "second");
}

TEST_CASE("a path that cannot be a directory is rejected") {
    const scratch place;
    put(place / "file", "x");
    atomic_dir directory;
    message text;
    CHECK(atomic_dir_begin(&directory, (place / "file").c_str(), &text) < 0);
    CHECK(atomic_dir_begin(&directory, (place / "file/below").c_str(), &text) < 0);
    CHECK(atomic_dir_begin(&directory, "", &text) < 0);
    CHECK(atomic_dir_begin(&directory, std::string(5000, 'a').c_str(), &text) < 0);
    CHECK(atomic_dir_begin(&directory, "/proc/nowhere/out", &text) < 0);
    CHECK(listing(place.path) == std::set<std::string>{"file"});
}

TEST_CASE("leftovers of a killed run are removed, those of a running one are not") {
    const scratch place;
    atomic_dir living, next;
    message text;
    const utimbuf long_ago{time(nullptr) - 3600, time(nullptr) - 3600};
    REQUIRE(atomic_dir_begin(&living, (place / "one").c_str(), &text) == ERROR_OK);
    fs::create_directory(place / ".vergence-killed");
    put(place / ".vergence-killed/mesh.ply", "half");
    fs::create_directory(place / ".vergence-young");
    utime((place / ".vergence-killed").c_str(), &long_ago);
    utime(living.work_path, &long_ago);
    REQUIRE(atomic_dir_begin(&next, (place / "two").c_str(), &text) == ERROR_OK);
    CHECK_FALSE(fs::exists(place / ".vergence-killed"));
    CHECK(fs::exists(place / ".vergence-young"));
    CHECK(fs::exists(living.work_path));
    atomic_dir_abort(&living);
    atomic_dir_abort(&next);
    CHECK(listing(place.path) == std::set<std::string>{".vergence-young"});
}
