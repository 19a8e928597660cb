// SPDX-License-Identifier: Apache-2.0
/// A camera under test, its log, and the fake one behind it.
#ifndef VERGENCE_TESTS_LINUX_CAMERA_HARNESS_HPP
#define VERGENCE_TESTS_LINUX_CAMERA_HARNESS_HPP

#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "daemon/backends/linux/v4l2_camera.h"
#include "fake_video.h"
#include "linux_harness.hpp"

namespace linux_harness {

constexpr uint32_t kFrame_us = 33333;
inline const char *const kVideo = "/dev/video0";

/// Number of mapped buffers of fake devices.
inline long mappings() {
    std::ifstream maps("/proc/self/maps");
    long count = 0;
    for (std::string line; std::getline(maps, line);) {
        count += line.find("memfd:fake") != std::string::npos;
    }
    return count;
}

struct Log {
    std::vector<std::string> lines;
    hal_log_operations operations{[](void *self, hal_log_level level, const char *text) {
        static_cast<Log *>(self)->lines.push_back(std::to_string(level) + " " + text);
    }};
    hal_log hal{&operations, this};
};

struct Camera {
    Log log;
    v4l2_camera camera{};
    message text{};
    hal_camera_frame last{};
    int opened;

    explicit Camera(const char *path = kVideo)
        : opened(v4l2_camera_open(&camera, path, kFrame_us, &log.hal, &text)) {}
    Camera(const Camera &) = delete;
    Camera &operator=(const Camera &) = delete;
    ~Camera() {
        raw_image_release(&last.image);
        if (opened == ERROR_OK) {
            v4l2_camera_close(&camera);
        }
        CHECK(mappings() == 0);
    }

    int start(uint16_t width_px, uint16_t height_px) {
        const hal_camera_format format = {width_px, height_px};
        return camera.hal.operations->start(camera.hal.self, &format);
    }
    int stop() { return camera.hal.operations->stop(camera.hal.self); }
    int take(hal_camera_frame *frame, uint64_t not_before_us = 0, uint64_t wait_us = 1000000) {
        return camera.hal.operations->take(camera.hal.self, not_before_us,
                                           fake_kernel_now_us() + wait_us, frame);
    }
    /// Takes a frame, whose image exists until the next one.
    int look(hal_camera_frame *frame, uint64_t not_before_us = 0, uint64_t wait_us = 1000000) {
        const int error = take(frame, not_before_us, wait_us);
        if (error == ERROR_OK) {
            raw_image_release(&last.image);
            last = *frame;
        }
        return error;
    }
    int control(hal_camera_control which, int32_t value, int32_t *applied) {
        return camera.hal.operations->control(camera.hal.self, which, value, applied);
    }
    hal_camera_counts counts() {
        hal_camera_counts counts;
        camera.hal.operations->counts(camera.hal.self, &counts);
        return counts;
    }
};

}  // namespace linux_harness

#endif
