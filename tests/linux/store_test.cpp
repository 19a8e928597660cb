// SPDX-License-Identifier: Apache-2.0
// The settings store: always the complete old or new record, whatever fails at any system call.
#include "daemon/backends/store/store.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "linux_harness.hpp"
#include "scratch.hpp"

namespace {

namespace fs = std::filesystem;
using linux_harness::record;

const std::string kOld(10000, 'o'), kNew(12345, 'n');

struct Store {
    ::store store{};
    message text{};
    int opened;

    explicit Store(const std::string &path) : opened(store_open(&store, path.c_str(), &text)) {}
    Store(const Store &) = delete;
    Store &operator=(const Store &) = delete;
    ~Store() { store_close(&store); }

    int save(const std::string &name, const std::string &data) {
        return store.hal.operations->save(store.hal.self, name.c_str(), data.data(), data.size());
    }
    int remove(const std::string &name) {
        return store.hal.operations->remove(store.hal.self, name.c_str());
    }
    int load(const std::string &name, std::string *data, size_t capacity = 100000) {
        data->assign(capacity, '?');
        size_t bytes = 0;
        const int error =
            store.hal.operations->load(store.hal.self, name.c_str(), &(*data)[0], capacity, &bytes);
        data->resize(error == ERROR_OK ? bytes : 0);
        return error;
    }
};

std::string load(const std::string &path, const std::string &name) {
    Store store(path);
    std::string data;
    REQUIRE(store.opened == ERROR_OK);
    const int error = store.load(name, &data);
    return error == ERROR_OK ? data : std::string("error: ") + error_text(error);
}

std::set<std::string> listing(const std::string &path) {
    std::set<std::string> names;
    for (const fs::directory_entry &entry : fs::directory_iterator(path)) {
        names.insert(entry.path().filename().string());
    }
    return names;
}

// A directory with two records, watched by the fake kernel.
struct Place {
    linux_harness::Kernel kernel;
    scratch directory;
    std::string path;

    Place() : path(directory / "settings") {
        fake_kernel_watch(path.c_str());
        Store store(path);
        REQUIRE(store.opened == ERROR_OK);
        REQUIRE(store.save("limits", kOld) == ERROR_OK);
        REQUIRE(store.save("other", "untouched") == ERROR_OK);
        store_close(&store.store);
        fake_kernel_forget();
    }
};

// Runs `work` in a separate process; returns its exit status as wait() does.
int in_child(const std::function<int()> &work) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        _exit(work());
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    return status;
}

enum class Change { Save, First, Remove };

int change(const std::string &path, Change what) {
    Store store(path);
    if (store.opened != ERROR_OK) {
        return store.opened;
    }
    return what == Change::Save    ? store.save("limits", kNew)
           : what == Change::First ? store.save("first", kNew)
                                   : store.remove("limits");
}

// The valid contents of the changed record: old and new.
std::string changed(const std::string &path, Change what) {
    return load(path, what == Change::First ? "first" : "limits");
}

const std::string kMissing = "error: a required field is missing";

std::string before(Change what) {
    return what == Change::First ? kMissing : kOld;
}

std::string after(Change what) {
    return what == Change::Remove ? kMissing : kNew;
}

constexpr Change kChanges[] = {Change::Save, Change::First, Change::Remove};

}  // namespace

TEST_CASE("the calls of a save: it syncs the file, then its name") {
    const Place place;
    Store store(place.path);
    CHECK(record() ==
          "settings mkdir\n"
          "settings open rdonly directory cloexec\n"
          "settings flock\n"
          ".. open rdonly directory cloexec\n"
          ".. fsync\n"
          ".. close\n"
          ". open rdonly directory cloexec\n"
          ". readdir\n. readdir\n. readdir\n. readdir\n. readdir\n");
    const std::string own = ".vergence-" + std::to_string(getpid()) + "-0";
    CHECK(store.save("limits", kNew) == ERROR_OK);
    CHECK(record() == own + " open wronly create excl noctty nofollow cloexec\n" + own +
                          " flock\n" + own + " write 58\n" + own + " write 12345\n" + own +
                          " fsync\n" + own +
                          " close\n"
                          "settings rename " +
                          own +
                          " limits\n"
                          "settings fsync\n");
    std::string data;
    CHECK(store.load("limits", &data) == ERROR_OK);
    CHECK(data == kNew);
    CHECK(record() ==
          "limits open rdonly noctty nonblock nofollow cloexec\n"
          "limits read 58\n"
          "limits read 12345\n"
          "limits read 1\n"
          "limits close\n");
    CHECK(store.remove("limits") == ERROR_OK);
    CHECK(record() == "settings unlink limits\nsettings fsync\n");
    CHECK(store.remove("limits") == ERROR_MISSING);
    CHECK(store.load("limits", &data) == ERROR_MISSING);
}

TEST_CASE("the directory's name is synced before it has a record") {
    const linux_harness::Kernel kernel;
    const scratch directory;
    const std::string path = directory / "new";
    fake_kernel_watch(path.c_str());
    {
        const Store store(path);
        REQUIRE(store.opened == ERROR_OK);
        CHECK(record().rfind("new mkdir\n"
                             "new open rdonly directory cloexec\n"
                             "new flock\n"
                             ".. open rdonly directory cloexec\n"
                             ".. fsync\n"
                             ".. close\n",
                             0) == 0);
    }
    for (const int error : {EINTR, EINVAL, ENOTSUP, EIO, ENOSPC}) {
        REQUIRE(rmdir(path.c_str()) == 0);
        fake_kernel_fail(".. fsync", 1, error, 1);
        const int expected = error == EIO ? ERROR_IO : error == ENOSPC ? ERROR_FULL : ERROR_OK;
        CHECK(Store(path).opened == expected);
        CHECK(fake_kernel_failed());
    }
}

TEST_CASE("a record is a line of text followed by the unchanged contents") {
    const Place place;
    std::ostringstream text;
    text << std::ifstream(place.path + "/other").rdbuf();
    CHECK(text.str() == "vergence record 1:         9 bytes follow, crc32 e209aa13\nuntouched");
    struct stat status;
    REQUIRE(stat((place.path + "/other").c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0600);
    REQUIRE(stat(place.path.c_str(), &status) == 0);
    CHECK((status.st_mode & 0777) == 0700);
}

TEST_CASE("killed at each system call in turn: the complete old or new record") {
    for (const Change what : kChanges) {
        unsigned nth = 1, olds = 0, news = 0;
        for (;; nth++) {
            const Place place;
            const int status = in_child([&] {
                fake_kernel_kill("", nth);
                return change(place.path, what) == ERROR_OK ? 42 : 43;
            });
            CAPTURE(nth);
            if (WIFEXITED(status)) {
                CHECK(WEXITSTATUS(status) == 42);
                CHECK(changed(place.path, what) == after(what));
                break;
            }
            REQUIRE(WTERMSIG(status) == SIGKILL);
            const std::string now = changed(place.path, what);
            olds += now == before(what);
            news += now == after(what);
            CHECK((now == before(what) || now == after(what)));
            CHECK(load(place.path, "other") == "untouched");
            for (const std::string &name : listing(place.path)) {
                CHECK(name[0] != '.');  // the next start has removed leftovers
            }
            // The store works normally afterwards.
            CHECK(Store(place.path).save("limits", "again") == ERROR_OK);
            CHECK(load(place.path, "limits") == "again");
        }
        CHECK(nth >= 10);
        CHECK(olds >= 8);
        CHECK(news >= 1);
        CHECK(olds + news == nth - 1);
    }
}

TEST_CASE("a kill in the middle of a write leaves a whole record") {
    for (unsigned write = 1; write <= 2; write++) {
        const Place place;
        const int status = in_child([&] {
            fake_kernel_short(" write", write, 1);
            fake_kernel_kill(" write", write + 1);
            return change(place.path, Change::Save);
        });
        REQUIRE(WIFSIGNALED(status));
        CHECK(load(place.path, "limits") == kOld);
    }
}

TEST_CASE("each system call fails in turn: the old or the new record, and the right error") {
    const struct {
        int system, ours;
    } pairs[] = {{EIO, ERROR_IO},        {ENOSPC, ERROR_FULL},    {EDQUOT, ERROR_FULL},
                 {EROFS, ERROR_REFUSED}, {EACCES, ERROR_REFUSED}, {ENOMEM, ERROR_IO}};
    for (const auto &pair : pairs) {
        for (const unsigned times : {1U, 0U}) {
            for (const Change what : kChanges) {
                unsigned nth = 1, succeeded = 0;
                for (;; nth++) {
                    const Place place;
                    record();
                    fake_kernel_fail("", nth, pair.system, times);
                    const int error = change(place.path, what);
                    const bool failed = fake_kernel_failed();
                    INFO("call ", nth, " gives ", pair.system, "; record:\n", record());
                    fake_kernel_reset();
                    fake_kernel_watch(place.path.c_str());
                    if (!failed) {
                        CHECK(error == ERROR_OK);
                        break;
                    }
                    CHECK((error == ERROR_OK || error == pair.ours));
                    succeeded += error == ERROR_OK;
                    const std::string now = changed(place.path, what);
                    if (error == ERROR_OK) {
                        CHECK(now == after(what));
                    } else {
                        CHECK((now == before(what) || now == after(what)));
                    }
                    CHECK(load(place.path, "other") == "untouched");
                    CHECK(Store(place.path).save("limits", "again") == ERROR_OK);
                    CHECK(load(place.path, "limits") == "again");
                }
                CHECK(nth >= 10);
                // These may fail: creating the existing directory, syncing its name again, cleaning
                // up, closing it.
                CHECK(succeeded <= 13);
            }
        }
    }
}

TEST_CASE("a full disk: saves fail, the record stays, no files are left behind") {
    const Place place;
    Store store(place.path);
    fake_kernel_fail(" write", 1, ENOSPC, 0);
    fake_kernel_fail(" fsync", 1, ENOSPC, 0);
    for (int i = 0; i < 3; i++) {
        CHECK(store.save("limits", kNew) == ERROR_FULL);
        std::string data;
        CHECK(store.load("limits", &data) == ERROR_OK);
        CHECK(data == kOld);
    }
    CHECK(listing(place.path) == std::set<std::string>{"limits", "other"});
}

TEST_CASE("each system call of a load fails in turn: an error, never a partial record") {
    for (const int error : {EIO, EACCES, ENOMEM}) {
        for (unsigned nth = 1; nth <= 4; nth++) {
            const Place place;
            Store store(place.path);
            std::string data;
            fake_kernel_fail("limits ", nth, error, 1);
            CHECK(store.load("limits", &data) == (error == EACCES ? ERROR_REFUSED : ERROR_IO));
            CHECK(store.load("limits", &data) == ERROR_OK);
            CHECK(data == kOld);
        }
    }
}

TEST_CASE("signals, short reads and short writes have no effect") {
    for (const char *call : {" open", " write", " read ", " fsync", " close"}) {
        CAPTURE(call);
        const Place place;
        fake_kernel_fail(call, 1, EINTR, 3);
        std::string data;
        {
            Store store(place.path);
            REQUIRE(store.opened == ERROR_OK);
            CHECK(store.save("limits", kNew) == ERROR_OK);
            CHECK(store.load("limits", &data) == ERROR_OK);
            CHECK(data == kNew);
        }
        CHECK(fake_kernel_failed());
    }
    for (const char *call : {" write", " read "}) {
        const Place place;
        fake_kernel_short(call, 1, 0);
        std::string data;
        Store store(place.path);
        CHECK(store.save("limits", kNew) == ERROR_OK);
        CHECK(store.load("limits", &data) == ERROR_OK);
        CHECK(data == kNew);
    }
}

TEST_CASE("a file system that cannot sync directories is accepted") {
    for (const int error : {EINVAL, ENOTSUP}) {
        const Place place;
        Store store(place.path);
        fake_kernel_fail("settings fsync", 1, error, 0);
        CHECK(store.save("limits", kNew) == ERROR_OK);
        CHECK(store.remove("limits") == ERROR_OK);
    }
}

TEST_CASE("any changed, missing or added byte is detected") {
    const Place place;
    fake_kernel_reset();
    std::ostringstream stream;
    stream << std::ifstream(place.path + "/other").rdbuf();
    const std::string good = stream.str();
    const auto put = [&](const std::string &text) {
        std::ofstream(place.path + "/other", std::ios::binary) << text;
    };
    Store store(place.path);
    std::string data;
    for (size_t i = 0; i < good.size(); i++) {
        for (const int flip : {0x01, 0x10, 0x80}) {
            std::string bad = good;
            bad[i] = static_cast<char>(bad[i] ^ flip);
            put(bad);
            const int error = store.load("other", &data, 1000);
            CHECK((error == ERROR_CRC || error == ERROR_BUFFER));
        }
        put(good.substr(0, i));
        CHECK(store.load("other", &data) == ERROR_CRC);
    }
    put(good + "x");
    CHECK(store.load("other", &data) == ERROR_CRC);
    put(good);
    CHECK(store.load("other", &data) == ERROR_OK);
    CHECK(store.load("other", &data, 9) == ERROR_OK);
    CHECK(store.load("other", &data, 8) == ERROR_BUFFER);
    // A record under another record's name is invalid.
    fs::rename(place.path + "/other", place.path + "/limits");
    CHECK(store.load("limits", &data) == ERROR_CRC);
}

TEST_CASE("invalid names are rejected, and so are files that are not records") {
    const Place place;
    Store store(place.path);
    std::string data;
    record();
    for (const std::string &name :
         {std::string(), std::string("."), std::string(".."), std::string(".vergence-1-0"),
          std::string("../x"), std::string("a/b"), std::string("1a"), std::string("a b"),
          std::string("a\n"), std::string("\xC3\xA4"), std::string(41, 'a')}) {
        CAPTURE(name);
        CHECK(store.save(name, "x") == ERROR_ARGUMENT);
        CHECK(store.load(name, &data) == ERROR_ARGUMENT);
        CHECK(store.remove(name) == ERROR_ARGUMENT);
    }
    CHECK(record().empty());
    for (const std::string &name : {std::string("a"), std::string("Z9-_."), std::string(40, 'a')}) {
        CHECK(store.save(name, "") == ERROR_OK);
        CHECK(store.load(name, &data) == ERROR_OK);
        CHECK(data.empty());
    }
    REQUIRE(symlink("other", (place.path + "/link").c_str()) == 0);
    CHECK(store.load("link", &data) == ERROR_REFUSED);
    REQUIRE(mkfifo((place.path + "/pipe").c_str(), 0600) == 0);
    CHECK(store.load("pipe", &data) == ERROR_CRC);  // the call does not wait for a writer
}

TEST_CASE("two processes cannot share a store, and the message says so") {
    const Place place;
    {
        const Store first(place.path);
        REQUIRE(first.opened == ERROR_OK);
        const Store second(place.path);
        CHECK(second.opened == ERROR_REFUSED);
        const std::string text = second.text.text;
        CHECK(text.find(place.path) != std::string::npos);
        CHECK(text.find("locked") != std::string::npos);
    }
    CHECK(Store(place.path).opened == ERROR_OK);
    CHECK(Store(place.path + "/no/such").opened == ERROR_MISSING);
    CHECK(Store(place.path + "/limits").opened == ERROR_MISSING);  // no directory
}
