// SPDX-License-Identifier: Apache-2.0
// "settings save", killed and failed at each system call: the saved settings are completely the old
// or completely the new ones.
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <string>

#include "core/error.h"
#include "daemon/backends/store/store.h"
#include "daemon/settings/saved_settings.h"
#include "linux_harness.hpp"
#include "scratch.hpp"

namespace {

saved_settings of_exposure(int32_t exposure_us) {
    rig up{};
    REQUIRE(rig_profile_named("two-cameras", &up.profile) == ERROR_OK);
    up.state = RIG_READY;
    up.format = {640, 480};
    up.camera[RIG_LEFT].exposure_us = up.camera[RIG_RIGHT].exposure_us =
        static_cast<uint32_t>(exposure_us);
    for (rig_camera &camera : up.camera) {
        for (int32_t &axis : camera.lens.commanded) {
            axis = INT32_MIN;
        }
    }
    saved_settings saved{};
    saved_settings_take(&up, &saved);
    return saved;
}

int save(const std::string &path, const saved_settings &saved) {
    store store;
    message why;
    char text[SAVED_SETTINGS_BYTES];
    const size_t length = saved_settings_print(&saved, text);
    int error = store_open(&store, path.c_str(), &why);
    if (error == ERROR_OK) {
        error = store.hal.operations->save(store.hal.self, SAVED_SETTINGS_RECORD, text, length);
    }
    store_close(&store);
    return error;
}

// The saved exposure, equal on both sides.
int32_t load(const std::string &path) {
    store store;
    message why;
    char text[SAVED_SETTINGS_BYTES];
    size_t length = 0;
    saved_settings saved{};
    REQUIRE(store_open(&store, path.c_str(), &why) == ERROR_OK);
    REQUIRE(store.hal.operations->load(store.hal.self, SAVED_SETTINGS_RECORD, text, sizeof text,
                                       &length) == ERROR_OK);
    store_close(&store);
    REQUIRE(saved_settings_parse(text, length, &saved, &why) == ERROR_OK);
    CHECK(saved.values[RIG_LEFT][SAVED_EXPOSURE_US] == saved.values[RIG_RIGHT][SAVED_EXPOSURE_US]);
    CHECK(saved.width_px == 640);
    return saved.values[RIG_LEFT][SAVED_EXPOSURE_US];
}

constexpr int32_t kOldUs = 7000, kNewUs = 1234567;

// A store with the old settings, watched by the fake kernel.
struct Place {
    linux_harness::Kernel kernel;
    scratch directory;
    std::string path;

    Place() : path(directory / "store") {
        REQUIRE(save(path, of_exposure(kOldUs)) == ERROR_OK);
        fake_kernel_watch(path.c_str());
        fake_kernel_forget();
    }
};

}  // namespace

TEST_CASE("killed at each system call in turn: complete old or complete new settings") {
    unsigned nth = 1, olds = 0, news = 0;
    for (;; nth++) {
        const Place place;
        const pid_t child = fork();
        REQUIRE(child >= 0);
        if (child == 0) {
            fake_kernel_kill("", nth);
            _exit(save(place.path, of_exposure(kNewUs)) == ERROR_OK ? 42 : 43);
        }
        int status = 0;
        REQUIRE(waitpid(child, &status, 0) == child);
        CAPTURE(nth);
        const int32_t now_us = load(place.path);
        if (WIFEXITED(status)) {
            CHECK(WEXITSTATUS(status) == 42);
            CHECK(now_us == kNewUs);
            break;
        }
        REQUIRE(WTERMSIG(status) == SIGKILL);
        olds += now_us == kOldUs;
        news += now_us == kNewUs;
        CHECK(olds + news == nth);
        CHECK(save(place.path, of_exposure(1)) == ERROR_OK);
        CHECK(load(place.path) == 1);
    }
    CHECK(olds >= 8);
    CHECK(news >= 1);
}

TEST_CASE(
    "every system call fails in turn: the old settings or the new ones, and the right error") {
    const struct {
        int system, ours;
    } pairs[] = {{EIO, ERROR_IO}, {ENOSPC, ERROR_FULL}, {EROFS, ERROR_REFUSED}};
    for (const auto &pair : pairs) {
        unsigned nth = 1, failures = 0;
        for (;; nth++) {
            const Place place;
            fake_kernel_fail("", nth, pair.system, 1);
            const int error = save(place.path, of_exposure(kNewUs));
            const bool failed = fake_kernel_failed();
            CAPTURE(nth);
            fake_kernel_reset();
            const int32_t now_us = load(place.path);
            if (!failed) {
                CHECK(error == ERROR_OK);
                CHECK(now_us == kNewUs);
                break;
            }
            failures += error != ERROR_OK;
            CHECK((error == ERROR_OK || error == pair.ours));
            CHECK((now_us == kNewUs || (error != ERROR_OK && now_us == kOldUs)));
        }
        CHECK(failures >= 6);
    }
}
