// SPDX-License-Identifier: Apache-2.0
// hal_camera on V4L2: its calls, times and numbers, and what happens when the stream breaks.
#include <set>

#include "camera_harness.hpp"

namespace {

using namespace linux_harness;

constexpr uint16_t kWidth = 64, kHeight = 48;

fake_video *grey_camera() {
    return fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
}

}  // namespace

TEST_CASE("a frame has correct metadata") {
    const Kernel kernel;
    grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    for (uint32_t i = 0; i < 5; i++) {
        REQUIRE(camera.look(&frame) == ERROR_OK);
        CHECK(frame.image.width_px == kWidth);
        CHECK(frame.image.height_px == kHeight);
        CHECK(frame.image.stride == kWidth);
        CHECK(frame.image.bits == 8);
        CHECK(frame.image.layout == RAW_GREY);
        CHECK(frame.faults == 0);
        CHECK(frame.sequence == i + 1);
        CHECK(frame.end_us == kStart_us + (i + 1) * kFrame_us);
        CHECK(frame.begin_us == kStart_us + i * kFrame_us);
        CHECK(frame.image.data[0] == i);
        CHECK(frame.image.data[47 * kWidth + 63] == 47 + 63 + i);
        CHECK(fake_kernel_now_us() == frame.end_us);
    }
    CHECK(camera.counts().frames == 5);
    CHECK(camera.counts().gaps == 0);
    CHECK(camera.log.lines.empty());
}

TEST_CASE("a frame that began too early is skipped") {
    const Kernel kernel;
    for (const bool begins : {false, true}) {
        fake_kernel_reset();
        fake_kernel_virtual_time(kStart_us);
        fake_video *video = grey_camera();
        video->time_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC |
                            (begins ? V4L2_BUF_FLAG_TSTAMP_SRC_SOE : V4L2_BUF_FLAG_TSTAMP_SRC_EOF);
        Camera camera;
        REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
        hal_camera_frame frame;
        // The frames that begin at 0 and 33333 do not count.
        REQUIRE(camera.look(&frame, kStart_us + kFrame_us + 1) == ERROR_OK);
        CHECK(frame.begin_us == kStart_us + 2 * kFrame_us);
        CHECK(frame.end_us == kStart_us + 3 * kFrame_us);
        CHECK(frame.sequence == 3);
        // Old frames stay in the queue; none of them is taken as a new one.
        fake_kernel_advance(4 * kFrame_us);
        const uint64_t now_us = fake_kernel_now_us();
        REQUIRE(camera.look(&frame, now_us) == ERROR_OK);
        CHECK(frame.begin_us >= now_us);
        CHECK(frame.begin_us <= now_us + 2 * kFrame_us);
        CHECK(camera.counts().frames == 2);
    }
}

TEST_CASE("a stamp of the start of exposure precedes the last pixel") {
    const Kernel kernel;
    fake_kernel_virtual_time(kStart_us);
    fake_video *video = grey_camera();
    video->time_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    video->controls[0] = {V4L2_CID_EXPOSURE_ABSOLUTE, 1, 20000, 1, 100};
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    int32_t applied = 0;
    REQUIRE(camera.control(HAL_CAMERA_EXPOSURE_US, 20000, &applied) == ERROR_OK);
    REQUIRE(applied == 20000);
    fake_kernel_advance(4 * kFrame_us);  // it waits in the queue, so the current time is irrelevant
    hal_camera_frame frame;
    REQUIRE(camera.look(&frame, kStart_us) == ERROR_OK);
    CHECK(frame.end_us == frame.begin_us + 20000 + kFrame_us);
}

TEST_CASE("without driver time stamps frames never appear newer than they are") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    video->time_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
    // A frame's first byte is the time when it began, in frame times.
    static uint64_t origin_us;
    origin_us = kStart_us;
    video->paint = [](fake_video *self, uint32_t, uint8_t *data, size_t *) {
        data[0] = static_cast<uint8_t>((self->next_us - kFrame_us - origin_us) / kFrame_us);
    };
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    uint32_t taken = 0;
    for (int i = 0; i < 50; i++) {
        fake_kernel_advance(static_cast<uint64_t>(i * 7919 % 200000));
        // Also past times: a queued frame may be older than it looks.
        const uint64_t not_before_us =
            fake_kernel_now_us() - static_cast<uint64_t>(i % 4) * uint64_t{20000};
        REQUIRE(camera.look(&frame, not_before_us, 400000) == ERROR_OK);
        const uint64_t began_us = origin_us + frame.image.data[0] * uint64_t{kFrame_us};
        CHECK(began_us >= not_before_us);
        CHECK(frame.begin_us >= not_before_us);
        CHECK(frame.begin_us <= began_us);
        CHECK(frame.end_us >= began_us + kFrame_us);
        taken++;
        origin_us += frame.image.data[0] >= 200 ? 200 * uint64_t{kFrame_us} : 0;
    }
    CHECK(taken == 50);
}

TEST_CASE("a call ends exactly at its deadline") {
    const Kernel kernel;
    grey_camera()->first_us = 500000;
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    CHECK(camera.look(&frame, 0, 123456) == ERROR_TIMEOUT);
    CHECK(fake_kernel_now_us() == kStart_us + 123456);
    CHECK(camera.look(&frame, 0, 0) == ERROR_TIMEOUT);
    CHECK(camera.counts().timeouts == 2);
    CHECK(camera.counts().restarts == 0);
    // All frames are too early.
    CHECK(camera.look(&frame, UINT64_MAX, 1000000) == ERROR_TIMEOUT);
    CHECK(fake_kernel_now_us() == kStart_us + 1123456);
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.counts().timeouts == 3);
    // All queued frames are too early, and no time is left.
    fake_kernel_advance(3 * kFrame_us);
    CHECK(camera.look(&frame, UINT64_MAX, 0) == ERROR_TIMEOUT);
}

TEST_CASE("missed frames are counted") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    fake_kernel_advance(10 * kFrame_us);  // four frames find a buffer, six do not
    for (uint32_t i = 0; i < 4; i++) {
        REQUIRE(camera.look(&frame) == ERROR_OK);
        CHECK(frame.sequence == 2 + i);
    }
    CHECK(camera.counts().gaps == 0);
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.sequence == 12);
    CHECK(camera.counts().gaps == 6);
    // A driver with constant numbers has no gaps, and the camera's numbers continue.
    video->counts = false;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.sequence == 14);
    CHECK(camera.counts().gaps == 6);
    CHECK(camera.counts().restarts == 0);
}

TEST_CASE("the driver's frame flags are reported") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    video->corrupt = [](fake_video *, v4l2_buffer *buffer) {
        buffer->flags |= V4L2_BUF_FLAG_ERROR;
    };
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == HAL_CAMERA_DAMAGED);
    video->corrupt = [](fake_video *, v4l2_buffer *buffer) { buffer->bytesused -= kWidth; };
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == HAL_CAMERA_SHORT);
    CHECK(frame.image.data[46 * kWidth] == 47);
    CHECK(frame.image.data[47 * kWidth] == 0);
    video->corrupt = [](fake_video *, v4l2_buffer *buffer) { buffer->bytesused = 0; };
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == HAL_CAMERA_SHORT);
    CHECK(frame.image.data[0] == 0);
    video->corrupt = [](fake_video *, v4l2_buffer *buffer) { buffer->bytesused = 99999; };
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == HAL_CAMERA_DAMAGED);
    video->corrupt = nullptr;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == 0);
    CHECK(camera.counts().frames == 5);
    CHECK(camera.counts().faulty == 4);
}

TEST_CASE("a stopped stream is restarted, counted and logged") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    video->frames_until_still = 3;
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    uint32_t last = 0;
    for (int i = 0; i < 9; i++) {
        REQUIRE(camera.look(&frame) == ERROR_OK);
        CHECK(frame.sequence > last);
        CHECK(frame.faults == 0);
        last = frame.sequence;
    }
    CHECK(camera.counts().restarts == 2);
    CHECK(camera.counts().gaps == 2);
    CHECK(last == 11);
    CHECK(video->starts == 3);
    CHECK(fake_kernel_now_us() == kStart_us + 9 * kFrame_us + 2 * 100000);
    REQUIRE(camera.log.lines.size() == 2);
    CHECK(camera.log.lines[0] ==
          "4 camera /dev/video0: no frame for 100 ms; restarting the stream");
}

TEST_CASE("a stream is not broken because no frame comes while no caller waits for one") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    video->triggered = true;  // some drivers make a frame only while a caller waits
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    for (int i = 0; i < 3; i++) {
        fake_kernel_advance(5000000);
        fake_video_pulse(video);
        REQUIRE(camera.look(&frame) == ERROR_OK);
    }
    CHECK(camera.counts().restarts == 0);
    // Many short waits are as good as a long one.
    for (int i = 0; i < 20; i++) {
        CHECK(camera.look(&frame, 0, 15000) == ERROR_TIMEOUT);
        fake_kernel_advance(1000000);
    }
    CHECK(camera.counts().restarts > 0);
}

TEST_CASE("a long exposure is not a stopped stream") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    constexpr int32_t kExposure_us = 1500000;
    bool found = false;
    SUBCASE("set") {}
    SUBCASE("from before") {
        found = true;
    }
    video->controls[0] = {V4L2_CID_EXPOSURE_ABSOLUTE, 1, 20000, 1, found ? 15000 : 100};
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    int32_t applied_us = 0;
    REQUIRE(camera.control(found ? HAL_CAMERA_EXPOSURE_FOUND_US : HAL_CAMERA_EXPOSURE_US,
                           found ? 0 : kExposure_us, &applied_us) == ERROR_OK);
    REQUIRE(applied_us == kExposure_us);
    video->frame_us = kExposure_us;
    hal_camera_frame frame;
    for (int i = 0; i < 4; i++) {
        REQUIRE(camera.look(&frame, 0, 4 * kExposure_us) == ERROR_OK);
    }
    CHECK(camera.counts().restarts == 0);
    CHECK(camera.log.lines.empty());
    // A stopped stream is still detected.
    video->frames_until_still = 1;
    CHECK(camera.look(&frame, 0, 20 * uint64_t(kExposure_us)) == ERROR_OK);
    CHECK(camera.look(&frame, 0, 20 * uint64_t(kExposure_us)) == ERROR_OK);
    CHECK(camera.counts().restarts > 0);
}

TEST_CASE("a stream that breaks once is restarted; the call succeeds") {
    for (const int error : {EIO, EPIPE, EINVAL, ENOMEM, ETIMEDOUT, EPROTO}) {
        for (const char *call : {"DQBUF", "poll", " QBUF"}) {
            CAPTURE(error);
            CAPTURE(call);
            const Kernel kernel;
            grey_camera();
            Camera camera;
            REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
            record();
            hal_camera_frame frame;
            fake_kernel_fail(call, 1, error, 1);
            REQUIRE(camera.look(&frame) == ERROR_OK);
            REQUIRE(camera.look(&frame) == ERROR_OK);
            CHECK(fake_kernel_failed());
            CHECK(camera.counts().restarts == 1);
            CHECK(camera.log.lines.size() == 1);
            const std::string calls = record();
            CHECK(calls.find("STREAMOFF\nvideo0 ioctl REQBUFS 0\n") != std::string::npos);
        }
    }
}

TEST_CASE("other faults of a driver") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    video->corrupt = [](fake_video *self, v4l2_buffer *buffer) {
        buffer->index = 7;
        self->corrupt = nullptr;
    };
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.counts().restarts == 1);
    video->corrupt = [](fake_video *self, v4l2_buffer *buffer) {
        buffer->index = self->queued[0];  // a queued one, which it has not returned
        self->corrupt = nullptr;
    };
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.counts().restarts == 2);
    // Repeatedly ready without a frame.
    fake_kernel_fail("DQBUF", 1, EAGAIN, 20);
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.counts().restarts >= 3);
    // Turned off by another program: EINVAL; then a driver that only reports POLLERR.
    video->on = false;
    CHECK(camera.look(&frame) == ERROR_OK);
    video->on = false;
    fake_kernel_fail("DQBUF", 1, EAGAIN, 2);
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.log.lines.back() ==
          "4 camera /dev/video0: the driver reports an error (POLLERR); restarting the stream");
}

TEST_CASE("a reconnected camera works after the next start") {
    const Kernel kernel;
    grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    int32_t applied = 0;
    fake_kernel_fail("DQBUF", 1, ENODEV, 1);
    CHECK(camera.look(&frame) == ERROR_DEVICE);
    fake_kernel_fail(" open", 1, ENOENT, 2);
    record();
    CHECK(camera.start(kWidth, kHeight) == ERROR_DEVICE);
    CHECK(record() ==
          "video0 ioctl STREAMOFF\nvideo0 ioctl REQBUFS 0\nvideo0 ioctl REQBUFS 0\nvideo0 close\n"
          "video0 open rdwr noctty nonblock cloexec\n");
    CHECK(camera.log.lines.back().find("3 camera /dev/video0: No such file or directory; ") == 0);
    CHECK(camera.control(HAL_CAMERA_GAIN_PART, 1, &applied) == ERROR_DEVICE);
    CHECK(camera.stop() == ERROR_OK);
    CHECK(camera.start(kWidth, kHeight) == ERROR_DEVICE);
    CHECK(camera.start(kWidth, kHeight) == ERROR_OK);
    CHECK(camera.look(&frame) == ERROR_OK);
    CHECK(camera.look(&frame) == ERROR_OK);
}

TEST_CASE("a camera that is unplugged during a restart of its stream") {
    const Kernel kernel;
    grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    fake_kernel_fail("DQBUF", 1, EIO, 1);
    fake_kernel_fail("REQBUFS 4", 1, ENODEV, 0);
    CHECK(camera.look(&frame) == ERROR_DEVICE);
    CHECK(camera.counts().restarts == 1);
    CHECK(camera.log.lines.back() == "3 camera /dev/video0: REQBUFS: No such device");
}

TEST_CASE("a stream that stays broken: three attempts with pauses, then an error") {
    const Kernel kernel;
    grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    fake_kernel_fail("DQBUF", 1, EIO, 4);
    CHECK(camera.look(&frame) == ERROR_IO);
    CHECK(fake_kernel_now_us() == kStart_us + 60000);
    CHECK(camera.counts().restarts == 3);
    REQUIRE(camera.log.lines.size() == 4);
    CHECK(camera.log.lines[3] ==
          "3 camera /dev/video0: DQBUF: Input/output error; giving up for now");
    CHECK(camera.look(&frame) == ERROR_OK);

    // A short deadline is still met.
    fake_kernel_fail("DQBUF", 1, EIO, 0);
    const uint64_t before_us = fake_kernel_now_us();
    CHECK(camera.look(&frame, 0, 10000) == ERROR_TIMEOUT);
    CHECK(fake_kernel_now_us() == before_us + 10000);
}

TEST_CASE("a stream that breaks at the deadline is restarted for the next call") {
    const Kernel kernel;
    fake_video *video = grey_camera();
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    fake_kernel_fail("DQBUF", 1, EIO, 2);
    CHECK(camera.look(&frame, 0, 0) == ERROR_TIMEOUT);
    CHECK(fake_kernel_now_us() == kStart_us);
    CHECK(camera.counts().restarts == 1);
    CHECK(video->starts == 2);
    // The second error needs a pause, for which this call has no time: nothing more is logged.
    REQUIRE(camera.log.lines.size() == 1);
    CHECK(camera.log.lines[0] ==
          "4 camera /dev/video0: DQBUF: Input/output error; restarting the stream");
    CHECK(camera.look(&frame) == ERROR_OK);
}

TEST_CASE("an unplugged camera is reported at once") {
    for (const int error : {ENODEV, ENXIO}) {
        for (const char *call : {"DQBUF", "poll"}) {
            const Kernel kernel;
            grey_camera();
            Camera camera;
            REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
            hal_camera_frame frame;
            fake_kernel_fail(call, 1, error, 0);
            fake_kernel_fail("STREAMOFF", 1, error, 0);
            CHECK(camera.look(&frame) == ERROR_DEVICE);
            CHECK(fake_kernel_now_us() == kStart_us);
            CHECK(camera.counts().restarts == 0);
            CHECK(camera.stop() == ERROR_DEVICE);
        }
    }
}

TEST_CASE(
    "every call fails in turn, once and for ever: the right end, in time, nothing left over") {
    for (const int error : {EIO, ENODEV, EBUSY, ENOMEM, EINVAL, ENOTTY, EACCES, ENOSPC}) {
        for (const unsigned times : {1U, 0U}) {
            linux_harness::each_call_fails(
                error, times,
                [&] {
                    grey_camera();
                    Camera camera;
                    if (camera.opened != ERROR_OK) {
                        CHECK(std::string(camera.text.text).find(kVideo) != std::string::npos);
                        return camera.opened;
                    }
                    int result = camera.start(kWidth, kHeight);
                    CHECK((result == ERROR_OK || !camera.log.lines.empty()));
                    hal_camera_frame frame;
                    for (int i = 0; i < 3 && result == ERROR_OK; i++) {
                        const uint64_t before_us = fake_kernel_now_us();
                        result = camera.look(&frame);
                        CHECK(fake_kernel_now_us() <= before_us + 1000000);
                        CHECK((result != ERROR_OK || frame.faults == 0));
                    }
                    const int stopped = camera.stop();
                    return result == ERROR_OK ? stopped : result;
                },
                [&](unsigned, int result) {
                    const std::set<int> ours = {ERROR_OK,          ERROR_IO,      ERROR_DEVICE,
                                                ERROR_UNSUPPORTED, ERROR_TIMEOUT, ERROR_REFUSED};
                    CHECK(ours.count(result) == 1);
                });
        }
    }
}

TEST_CASE("signals during any call change nothing") {
    for (const char *call : {" open", "ioctl", "poll"}) {
        for (unsigned nth = 1; nth < 30; nth++) {
            const Kernel kernel;
            grey_camera();
            fake_kernel_fail(call, nth, EINTR, 3);
            Camera camera;
            REQUIRE(camera.opened == ERROR_OK);
            hal_camera_frame frame;
            CHECK(camera.start(kWidth, kHeight) == ERROR_OK);
            CHECK(camera.look(&frame) == ERROR_OK);
            CHECK(camera.look(&frame) == ERROR_OK);
            CHECK(frame.sequence == 2);
            CHECK(camera.stop() == ERROR_OK);
            CHECK(camera.log.lines.empty());
        }
    }
}
