// SPDX-License-Identifier: Apache-2.0
// A directory of results appears whole or not at all.
#include "daemon/files/atomic_dir.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <utime.h>

#include <cerrno>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "core/error.h"
#include "daemon/files/own_listing.h"
#include "daemon/files/own_remove.h"
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
    REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), names, 3, &text) == ERROR_OK);
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
    REQUIRE(atomic_dir_begin(&first, (place / "one").c_str(), names, 3, &text) == ERROR_OK);
    REQUIRE(atomic_dir_begin(&second, (place / "two").c_str(), names, 3, &text) == ERROR_OK);
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
    REQUIRE(atomic_dir_begin(&directory, (place / "out/").c_str(), names, 3, &text) == ERROR_OK);
    put_work(directory, "a.txt", "1");
    put_work(directory, "end.txt", "2");
    CHECK_FALSE(fs::exists(place / "out"));
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(listing(place.path) == std::set<std::string>{"out"});
    CHECK(listing(place / "out") == std::set<std::string>{OWN_LISTING_NAME, "a.txt", "end.txt"});
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
    REQUIRE(atomic_dir_begin(&directory, (place / "x/y/out").c_str(), names, 3, &text) == ERROR_OK);
    put_work(directory, "a.txt", "1");
    atomic_dir_abort(&directory);
    CHECK(listing(place.path).empty());
    REQUIRE(atomic_dir_begin(&directory, (place / "x/y/out").c_str(), names, 3, &text) == ERROR_OK);
    put_work(directory, "end.txt", "1");
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(fs::exists(place / "x/y/out/end.txt"));
}

TEST_CASE("an earlier set is replaced, other files stay") {
    const scratch place;
    atomic_dir directory;
    message text;
    for (const char *round : {"old", "new"}) {
        REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), names, 3, &text) == ERROR_OK);
        put_work(directory, "a.txt", round);
        if (std::string(round) == "old") {
            put_work(directory, "b.txt", round);
        }
        put_work(directory, "end.txt", round);
        REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
        put(place / "out/mine.txt", "mine");
    }
    CHECK(listing(place / "out") ==
          std::set<std::string>{OWN_LISTING_NAME, "a.txt", "end.txt", "mine.txt"});
    CHECK(contents(place / "out/a.txt") == "new");
    CHECK(contents(place / "out/mine.txt") == "mine");
}

TEST_CASE("a user's own files with our names are neither replaced nor removed") {
    const scratch place;
    atomic_dir directory;
    message text;
    fs::create_directory(place / "out");
    put(place / "out/a.txt", "mine");
    put(place / "out/b.txt", "mine");
    CHECK(atomic_dir_begin(&directory, (place / "out").c_str(), names, 3, &text) == ERROR_ARGUMENT);
    const std::string why = text.text;
    CHECK(why.find(place / "out/a.txt exists") != std::string::npos);
    CHECK(why.find("give another directory") != std::string::npos);
    // Known only at the end; b.txt is not written, and so is not in the way.
    REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), names, 0, &text) == ERROR_OK);
    put_work(directory, "a.txt", "new");
    put_work(directory, "end.txt", "new");
    CHECK(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_BUFFER);
    CHECK(text.text == why);
    CHECK(listing(place / "out") == std::set<std::string>{"a.txt", "b.txt"});
    fs::remove(place / "out/a.txt");
    REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), &names[2], 1, &text) == ERROR_OK);
    put_work(directory, "end.txt", "new");
    REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(contents(place / "out/b.txt") == "mine");
    CHECK(contents(place / "out/end.txt") == "new");
}

TEST_CASE("a failure leaves the earlier set unchanged") {
    for (const char *kind : {"pipe", "directory", "link"}) {
        const scratch place;
        atomic_dir directory;
        message text;
        REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), names, 3, &text) == ERROR_OK);
        for (const char *name : names) {
            put_work(directory, name, "old");
        }
        REQUIRE(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_OK);
        // Listed, but not what was written any more.
        fs::remove(place / "out/b.txt");
        put(place / "target", "mine");
        if (kind == std::string("pipe")) {
            REQUIRE(mkfifo((place / "out/b.txt").c_str(), 0600) == 0);
        } else if (kind == std::string("link")) {
            fs::create_symlink(place / "target", place / "out/b.txt");
        } else {
            fs::create_directories(place / "out/b.txt");
        }
        CHECK(atomic_dir_begin(&directory, (place / "out").c_str(), names, 3, &text) < 0);
        REQUIRE(atomic_dir_begin(&directory, (place / "out").c_str(), names, 0, &text) == ERROR_OK);
        for (const char *name : names) {
            put_work(directory, name, "new");
        }
        CHECK(atomic_dir_commit(&directory, names, 3, "end.txt", &text) == ERROR_BUFFER);
        const std::string why = text.text;
        CHECK(why.find(place / "out/b.txt exists") != std::string::npos);
        CHECK(contents(place / "out/a.txt") == "old");
        CHECK(contents(place / "out/end.txt") == "old");
        CHECK(contents(place / "target") == "mine");
        CHECK(listing(place / "out") ==
              std::set<std::string>{OWN_LISTING_NAME, "a.txt", "b.txt", "end.txt"});
    }
}

TEST_CASE("of two simultaneous runs the later one's set remains, whole") {
    const scratch place;
    atomic_dir first, second;
    message text;
    REQUIRE(atomic_dir_begin(&first, (place / "out").c_str(), names, 3, &text) == ERROR_OK);
    REQUIRE(atomic_dir_begin(&second, (place / "out").c_str(), names, 3, &text) == ERROR_OK);
    put_work(first, "a.txt", "first");
    put_work(first, "b.txt", "first");
    put_work(first, "end.txt", "first");
    put_work(second, "a.txt", "second");
    put_work(second, "end.txt", "second");
    REQUIRE(atomic_dir_commit(&first, names, 3, "end.txt", &text) == ERROR_OK);
    REQUIRE(atomic_dir_commit(&second, names, 3, "end.txt", &text) == ERROR_OK);
    CHECK(listing(place.path) == std::set<std::string>{"out"});
    CHECK(listing(place / "out") == std::set<std::string>{OWN_LISTING_NAME, "a.txt", "end.txt"});
    CHECK(contents(place / "out/a.txt") == "second");
    CHECK(contents(place / "out/end.txt") == "second");
}

TEST_CASE("a path that cannot be a directory is rejected") {
    const scratch place;
    put(place / "file", "x");
    atomic_dir directory;
    message text;
    CHECK(atomic_dir_begin(&directory, (place / "file").c_str(), names, 3, &text) < 0);
    CHECK(atomic_dir_begin(&directory, (place / "file/below").c_str(), names, 3, &text) < 0);
    CHECK(atomic_dir_begin(&directory, "", names, 3, &text) < 0);
    CHECK(atomic_dir_begin(&directory, std::string(5000, 'a').c_str(), names, 3, &text) < 0);
    CHECK(atomic_dir_begin(&directory, "/proc/nowhere/out", names, 3, &text) < 0);
    CHECK(listing(place.path) == std::set<std::string>{"file"});
}

TEST_CASE("leftovers of a killed run are removed, those of a running one are not") {
    const scratch place;
    atomic_dir living, next;
    message text;
    const utimbuf long_ago{time(nullptr) - 3600, time(nullptr) - 3600};
    REQUIRE(atomic_dir_begin(&living, (place / "one").c_str(), names, 3, &text) == ERROR_OK);
    // Of the user: another form of name.
    for (const char *name : {".vergence-4000000-0", ".vergence-mine", ".vergence-4000000-x"}) {
        fs::create_directory(place / name);
        put(place / name + "/mesh.ply", "half");
        utime((place / name).c_str(), &long_ago);
    }
    put(place / ".vergence-4000001-0", "half");
    utime((place / ".vergence-4000001-0").c_str(), &long_ago);
    fs::create_directory(place / ".vergence-4000002-0");  // too young
    utime(living.work_path, &long_ago);
    REQUIRE(atomic_dir_begin(&next, (place / "two").c_str(), names, 3, &text) == ERROR_OK);
    CHECK(fs::exists(living.work_path));
    atomic_dir_abort(&living);
    atomic_dir_abort(&next);
    CHECK(listing(place.path) ==
          std::set<std::string>{".vergence-4000000-x", ".vergence-4000002-0", ".vergence-mine"});
    CHECK(fs::exists(place / ".vergence-mine/mesh.ply"));
}

TEST_CASE("removal demands a proof, and never follows a link") {
    const scratch place;
    const int here = open(place.path.c_str(), O_RDONLY | O_DIRECTORY);
    REQUIRE(here >= 0);
    const auto removes = [here](const std::string &name, own_proof_kind kind, int fd = -1) {
        own_proof proof{kind, fd, [](const void *, const char *) { return true; }, nullptr, false};
        const bool removed = own_remove(here, name.c_str(), &proof);
        CHECK((removed || errno == EPERM || errno == ENOTEMPTY));
        return removed;
    };
    char own[OWN_NAME_BYTES];
    own_temporary_name(7, own);
    fs::create_directory(place / "target");
    put(place / "target/mine.txt", "mine");
    for (const own_proof_kind kind :
         {OWN_TEMPORARY, OWN_ABANDONED, OWN_OPEN, OWN_LISTED, OWN_EMPTY, OWN_SOCKET}) {
        fs::create_directory_symlink(place / "target", place / own);
        CHECK(!removes(own, kind));
        CHECK(!removes("target/mine.txt", kind));
        CHECK(!removes("target", kind));
        fs::remove(place / own);
    }
    // What a user put into a directory of ours stays, and the directory with it.
    fs::create_directory(place / own);
    put(place / own + "/half.ply", "half");
    fs::create_directory_symlink(place / "target", place / own + "/link");
    CHECK(!removes(own, OWN_TEMPORARY));
    CHECK(listing(place / own) == std::set<std::string>{"link"});
    fs::remove(place / own + "/link");
    CHECK(removes(own, OWN_TEMPORARY));
    // An open file, until its name denotes another.
    const int file = open((place / "file").c_str(), O_CREAT | O_WRONLY, 0600);
    fs::rename(place / "file", place / "moved");
    put(place / "file", "mine");
    CHECK(!removes("file", OWN_OPEN, file));
    CHECK(removes("moved", OWN_OPEN, file));
    close(file);
    close(here);
    CHECK(contents(place / "target/mine.txt") == "mine");
}
