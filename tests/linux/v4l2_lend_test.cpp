// SPDX-License-Identifier: Apache-2.0
// Frames that are lent: they stay in the driver's buffers, which take no memory a second time.
#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "camera_harness.hpp"
#include "scratch.hpp"

namespace {

using namespace linux_harness;

constexpr uint16_t kWidth = 64, kHeight = 48;

fake_video *mosaic_camera(uint16_t width_px = kWidth, uint16_t height_px = kHeight) {
    return fake_video_add(kVideo, V4L2_PIX_FMT_SGRBG10, width_px, height_px);
}

// States the memory that is free, as on a board.
class FreeMemory {
  public:
    explicit FreeMemory(uint64_t bytes) {
        state(bytes);
        REQUIRE(setenv("VERGENCE_MEMINFO", (folder_ / "meminfo").c_str(), 1) == 0);
    }
    ~FreeMemory() { unsetenv("VERGENCE_MEMINFO"); }
    FreeMemory(const FreeMemory &) = delete;
    FreeMemory &operator=(const FreeMemory &) = delete;
    void state(uint64_t bytes) const {
        folder_.write("meminfo", "MemAvailable: " + std::to_string(bytes / 1024) + " kB\n");
    }

  private:
    scratch folder_;
};

}  // namespace

TEST_CASE("lent frames keep their pixels whatever becomes of the stream") {
    const Kernel kernel;
    const FreeMemory memory(1 << 30);
    mosaic_camera();
    hal_camera_frame frames[12];
    {
        Camera camera;
        REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
        for (size_t i = 0; i < std::size(frames); i++) {
            CAPTURE(i);
            if (i == 10) {
                REQUIRE(camera.stop() == ERROR_OK);
                REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
            }
            REQUIRE(camera.take(&frames[i]) == ERROR_OK);
            CHECK(frames[i].faults == 0);
            CHECK((i == 0 || frames[i].sequence > frames[i - 1].sequence));
        }
        CHECK(camera.counts().restarts == 0);
        CHECK(camera.log.lines.empty());
        camera.stop();
        CHECK(mappings() == std::size(frames));
        v4l2_camera_close(&camera.camera);
        for (size_t i = 0; i < std::size(frames); i++) {
            CAPTURE(i);
            // Numbers of the fake camera, which begin at 0 with each stream, of four buffers.
            const size_t number = (i < 10 ? i : i - 10) % 4;
            const uint16_t *row = raw_image_row(&frames[i].image, 1);
            CHECK(row[0] == ((1 + number) | (2 + number) << 8) % 1024);
            raw_image_release(&frames[i].image);
        }
    }
}

TEST_CASE("the driver gets the buffer of a frame that is gone") {
    const Kernel kernel;
    const FreeMemory memory(1 << 30);
    fake_video *video = mosaic_camera();
    video->buffers_max = 2;
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame kept, frame;
    REQUIRE(camera.take(&kept) == ERROR_OK);
    for (int i = 0; i < 20; i++) {
        REQUIRE(camera.take(&frame, fake_kernel_now_us()) == ERROR_OK);
        raw_image_release(&frame.image);
    }
    CHECK(video->starts == 1);
    CHECK(mappings() == 2);
    raw_image_release(&kept.image);
}

TEST_CASE("without memory for other buffers lent frames must go first") {
    const Kernel kernel;
    constexpr uint64_t kFrame_bytes = 2 * 1000 * 1000;
    const FreeMemory memory(4 * kFrame_bytes);
    fake_video *video = mosaic_camera(1000, 1000);
    Camera camera;
    REQUIRE(camera.start(1000, 1000) == ERROR_OK);
    REQUIRE(camera.camera.stream.count == 2);
    hal_camera_frame first, second, third;
    REQUIRE(camera.take(&first) == ERROR_OK);
    REQUIRE(camera.take(&second) == ERROR_OK);
    memory.state(2 * kFrame_bytes);
    CHECK(camera.take(&third) == ERROR_MEMORY);
    REQUIRE(camera.log.lines.size() == 1);
    CHECK(camera.log.lines[0].find("two buffers of 2.0 MB, 4.0 MB are free") != std::string::npos);
    raw_image_release(&first.image);
    REQUIRE(camera.take(&third) == ERROR_OK);
    CHECK(video->starts == 1);
    raw_image_release(&second.image);
    raw_image_release(&third.image);
}

TEST_CASE("new buffers that cannot be had") {
    for (const char *call : {"REQBUFS 0", "REQBUFS 4", "mmap", " QBUF", "STREAMON"}) {
        for (const int error : {EIO, ENODEV, ENOMEM}) {
            CAPTURE(std::string(call));
            CAPTURE(error);
            const Kernel kernel;
            const FreeMemory memory(1 << 30);
            mosaic_camera();
            Camera camera;
            REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
            hal_camera_frame frames[5];
            for (size_t i = 0; i < 4; i++) {
                REQUIRE(camera.take(&frames[i]) == ERROR_OK);
            }
            fake_kernel_fail(call, 1, error, 1);
            const int taken = camera.take(&frames[4]);
            CAPTURE(taken);
            CHECK(fake_kernel_failed());
            const bool unmapped = error == ENODEV && std::string(call) == "mmap";
            CHECK((taken == ERROR_OK || taken == (unmapped          ? ERROR_UNSUPPORTED
                                                  : error == ENODEV ? ERROR_DEVICE
                                                                    : ERROR_MEMORY)));
            if (taken != ERROR_OK) {
                REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
                REQUIRE(camera.take(&frames[4]) == ERROR_OK);
            }
            for (hal_camera_frame &frame : frames) {
                const uint16_t *row = raw_image_row(&frame.image, 0);
                CHECK(row[1] % 256 == (2 + row[0]) % 256);
                raw_image_release(&frame.image);
            }
        }
    }
}

TEST_CASE("frames are copied where a driver cannot lend them") {
    const Kernel kernel;
    const FreeMemory memory(1 << 30);
    fake_video *video = mosaic_camera();
    SUBCASE("a driver that releases no mapped buffer") {
        video->keeps_orphans = false;
    }
    SUBCASE("rows of an odd number of bytes") {
        video->formats[0].bytes_per_line = 2 * kWidth + 1;
    }
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frames[5];
    for (hal_camera_frame &frame : frames) {
        REQUIRE(camera.take(&frame) == ERROR_OK);
    }
    CHECK(video->starts == 1);
    CHECK(camera.stop() == ERROR_OK);
    CHECK(mappings() == 0);
    for (hal_camera_frame &frame : frames) {
        raw_image_release(&frame.image);
    }
}

TEST_CASE("a driver that needs more buffers than lent frames leave it") {
    const Kernel kernel;
    const FreeMemory memory(1 << 30);
    fake_video *video = mosaic_camera();
    video->buffers_max = 2;
    video->keeps_buffers = 1;  // it fills a buffer only when it has the next one
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frames[6];
    for (hal_camera_frame &frame : frames) {
        REQUIRE(camera.take(&frame) == ERROR_OK);
    }
    CHECK(camera.counts().restarts == 1);
    CHECK(mappings() == 1 + 2);
    for (hal_camera_frame &frame : frames) {
        raw_image_release(&frame.image);
    }
}

TEST_CASE("excess bits and missing rows of a lent frame are cleared") {
    const Kernel kernel;
    const FreeMemory memory(1 << 30);
    fake_video *video = mosaic_camera();
    video->paint = [](fake_video *, uint32_t, uint8_t *data, size_t *bytes) {
        std::fill(data, data + *bytes, 0xFF);
    };
    video->corrupt = [](fake_video *, v4l2_buffer *buffer) { buffer->bytesused -= 1; };
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(camera.camera.stream.lends);
    CHECK(frame.faults == HAL_CAMERA_SHORT);
    CHECK(raw_image_row(&frame.image, 0)[0] == 1023);
    CHECK(raw_image_row(&frame.image, kHeight - 2)[kWidth - 1] == 1023);
    CHECK(raw_image_row(&frame.image, kHeight - 1)[0] == 0);
}
