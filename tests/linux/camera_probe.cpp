// SPDX-License-Identifier: Apache-2.0
// camera_probe DEVICE WIDTH HEIGHT FRAMES: prints the first pixel of each frame. A program without
// knowledge of the fake kernel, for preload_test.py.
#include <cstdio>
#include <cstdlib>

#include "core/error.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/backends/linux/stderr_log.h"
#include "daemon/backends/linux/v4l2_camera.h"
#include "daemon/base/monotonic.h"

namespace {

int fail(const char *what, int error) {
    std::printf("%s: %s\n", what, error_text(error));
    return 1;
}

int look(v4l2_camera *camera, const hal_camera_format &format, int frames) {
    const hal_camera_operations *operations = camera->hal.operations;
    int error = operations->start(camera->hal.self, &format);
    if (error != ERROR_OK) {
        return fail("start", error);
    }
    for (int i = 0; i < frames; i++) {
        hal_camera_frame frame;
        error = operations->take(camera->hal.self, monotonic_now_us(), monotonic_now_us() + 1000000,
                                 &frame);
        if (error != ERROR_OK) {
            return fail("take", error);
        }
        const int channels = frame.layout == HAL_CAMERA_RGB ? 3 : 1;
        std::printf("%u bits:", frame.bits);
        for (int c = 0; c < channels; c++) {
            std::printf(" %u", frame.data[c]);
        }
        std::printf(" faults %u\n", frame.faults);
        std::fflush(stdout);
        operations->give_back(camera->hal.self, &frame);
    }
    error = operations->stop(camera->hal.self);
    return error == ERROR_OK ? 0 : fail("stop", error);
}

}  // namespace

int main(int argc, char **argv) {
    if (argc != 5) {
        return 2;
    }
    stderr_log log;
    stderr_log_open(&log, HAL_LOG_INFO);
    v4l2_camera camera;
    message text;
    if (v4l2_camera_open(&camera, argv[1], 20000, &log.hal, &text) != ERROR_OK) {
        std::printf("%s\n", text.text);
        return 1;
    }
    const hal_camera_format format = {static_cast<uint16_t>(std::atoi(argv[2])),
                                      static_cast<uint16_t>(std::atoi(argv[3]))};
    const int result = look(&camera, format, std::atoi(argv[4]));
    v4l2_camera_close(&camera);
    stderr_log_close(&log);
    return result;
}
