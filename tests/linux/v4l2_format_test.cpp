// SPDX-License-Identifier: Apache-2.0
// Choice of a V4L2 camera's format, and conversion of its pixels.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "camera_harness.hpp"
#include "daemon/backends/linux/v4l2_jpeg.h"
#include "scratch.hpp"
#include "synthetic/seed.hpp"
// It needs stdio without including it.
#include <jpeglib.h>

namespace {

using namespace linux_harness;

constexpr uint16_t kWidth = 38, kHeight = 24;

std::vector<uint8_t> frame_bytes;

void use(fake_video *video, const std::vector<uint8_t> &bytes) {
    frame_bytes = bytes;
    video->paint = [](fake_video *, uint32_t, uint8_t *data, size_t *room) {
        REQUIRE(frame_bytes.size() <= *room);
        std::copy(frame_bytes.begin(), frame_bytes.end(), data);
        *room = frame_bytes.size();
    };
}

std::vector<uint8_t> random_bytes(size_t count) {
    std::mt19937 random(static_cast<uint32_t>(synthetic::test_seed()));
    std::vector<uint8_t> bytes(count);
    for (uint8_t &byte : bytes) {
        byte = static_cast<uint8_t>(random());
    }
    return bytes;
}

// A JPEG of a smooth image, with a restart marker after this many rows of blocks (0: none); its
// pixels in `rgb`.
std::vector<uint8_t> jpeg_of(std::vector<uint8_t> *rgb, unsigned restart_rows = 0) {
    rgb->resize(3 * size_t{kWidth} * kHeight);
    for (size_t i = 0; i < rgb->size(); i++) {
        const size_t x = i / 3 % kWidth, y = i / 3 / kWidth;
        (*rgb)[i] = static_cast<uint8_t>(40 + 2 * x + 3 * y + 10 * (i % 3));
    }
    jpeg_compress_struct info{};
    jpeg_error_mgr manager;
    info.err = jpeg_std_error(&manager);
    jpeg_create_compress(&info);
    unsigned char *memory = nullptr;
    unsigned long bytes = 0;
    jpeg_mem_dest(&info, &memory, &bytes);
    info.image_width = kWidth;
    info.image_height = kHeight;
    info.input_components = 3;
    info.in_color_space = JCS_RGB;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, 95, TRUE);
    info.restart_in_rows = static_cast<int>(restart_rows);
    jpeg_start_compress(&info, TRUE);
    while (info.next_scanline < kHeight) {
        JSAMPROW row = rgb->data() + 3 * size_t{kWidth} * info.next_scanline;
        jpeg_write_scanlines(&info, &row, 1);
    }
    jpeg_finish_compress(&info);
    jpeg_destroy_compress(&info);
    std::vector<uint8_t> result(memory, memory + bytes);
    free(memory);
    return result;
}

using Bytes = std::vector<uint8_t>;

// Position of the marker 0xFF `code`.
size_t marker_at(const Bytes &jpeg, uint8_t code) {
    for (size_t i = 0; i + 1 < jpeg.size(); i++) {
        if (jpeg[i] == 0xFF && jpeg[i + 1] == code) {
            return i;
        }
    }
    FAIL("no such marker");
    return 0;
}

// The JPEG with `count` bytes of `value` before a marker.
Bytes with_extra(Bytes jpeg, uint8_t code, size_t count, uint8_t value) {
    jpeg.insert(jpeg.begin() + static_cast<long>(marker_at(jpeg, code)), count, value);
    return jpeg;
}

// The JPEG without its segments of this marker.
Bytes without(Bytes jpeg, uint8_t code) {
    for (size_t i = 2; jpeg[i + 1] != 0xDA;) {
        const long bytes = 2 + (jpeg[i + 2] << 8 | jpeg[i + 3]);
        const auto begin = jpeg.begin() + static_cast<long>(i);
        if (jpeg[i + 1] == code) {
            jpeg.erase(begin, begin + bytes);
        } else {
            i += static_cast<size_t>(bytes);
        }
    }
    return jpeg;
}

// The reported faults of a frame of these bytes, and the largest difference of its pixels from
// `rgb`.
struct Shown {
    uint32_t faults;
    int worst;
};

Shown show(fake_video *video, Camera *camera, const Bytes &jpeg, const Bytes &rgb) {
    use(video, jpeg);
    hal_camera_frame frame;
    REQUIRE(camera->look(&frame) == ERROR_OK);
    Shown shown = {frame.faults, 0};
    for (size_t i = 0; i < rgb.size(); i++) {
        shown.worst = std::max(shown.worst, std::abs(rgb[i] - frame.image.data[i]));
    }
    return shown;
}

}  // namespace

TEST_CASE("the best of a camera's formats is chosen") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_MJPEG, kWidth, kHeight);
    video->formats[1] = {V4L2_PIX_FMT_YUYV, kWidth, kHeight, 0};
    video->formats[2] = {V4L2_PIX_FMT_GREY, kWidth * 2, kHeight * 2, 0};
    video->formats[3] = {V4L2_PIX_FMT_NV12, kWidth, kHeight, 0};
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    CHECK(std::string(camera.camera.stream.format->name) == "YUYV");
    REQUIRE(camera.start(kWidth * 2, kHeight * 2) == ERROR_OK);
    CHECK(std::string(camera.camera.stream.format->name) == "GREY");
    CHECK(camera.start(kWidth * 3, kHeight) == ERROR_UNSUPPORTED);
    const std::string line = camera.log.lines.back();
    CHECK(line.find("3 camera /dev/video0: ") == 0);
    CHECK(line.find("114 x 24") != std::string::npos);
    CHECK(line.find("nearest is 38 x 24") != std::string::npos);
    CHECK(camera.start(0, kHeight) == ERROR_UNSUPPORTED);
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
}

TEST_CASE("without bandwidth for YUYV it uses MJPEG; without any it is an error") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_YUYV, kWidth, kHeight);
    video->formats[1] = {V4L2_PIX_FMT_MJPEG, kWidth, kHeight, 0};
    Camera camera;
    fake_kernel_fail("STREAMON", 1, ENOSPC, 1);
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    CHECK(std::string(camera.camera.stream.format->name) == "MJPEG");
    REQUIRE(camera.stop() == ERROR_OK);
    fake_kernel_fail("STREAMON", 1, ENOSPC, 0);
    CHECK(camera.start(kWidth, kHeight) == ERROR_IO);
    CHECK(camera.log.lines.back().find("USB bandwidth") != std::string::npos);
}

TEST_CASE("mosaics: little-endian words, no excess bits, padded rows") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_SGRBG10, kWidth, kHeight);
    video->formats[0].bytes_per_line = 2 * kWidth + 10;
    const std::vector<uint8_t> bytes = random_bytes(size_t{kHeight} * (2 * kWidth + 10));
    use(video, bytes);
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.image.layout == RAW_BAYER_GRBG);
    CHECK(frame.image.bits == 10);
    CHECK(frame.faults == 0);
    bool equal = true;
    for (size_t y = 0; y < kHeight; y++) {
        for (size_t x = 0; x < kWidth; x++) {
            const size_t at = y * (2 * kWidth + 10) + 2 * x;
            const int value = (bytes[at] | bytes[at + 1] << 8) & 0x3FF;
            equal = equal && raw_image_row(&frame.image, int(y))[x] == value;
        }
    }
    CHECK(equal);
}

TEST_CASE("YUYV is converted by BT.601 to within half a step") {
    for (const bool full : {false, true}) {
        const Kernel kernel;
        fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_YUYV, kWidth, kHeight);
        video->full_range = full;
        const std::vector<uint8_t> bytes = random_bytes(size_t{kHeight} * 2 * kWidth);
        use(video, bytes);
        Camera camera;
        REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
        hal_camera_frame frame;
        REQUIRE(camera.look(&frame) == ERROR_OK);
        CHECK(frame.image.layout == RAW_RGB);
        CHECK(frame.image.stride == 3 * kWidth);
        double worst = 0;
        for (size_t i = 0; i < size_t{kWidth} * kHeight; i++) {
            const uint8_t *pair = &bytes[4 * (i / 2)];
            const double y = full ? pair[2 * (i % 2)] : (pair[2 * (i % 2)] - 16) * 255.0 / 219;
            const double scale = full ? 1 : 255.0 / 224;
            const double u = (pair[1] - 128) * scale, v = (pair[3] - 128) * scale;
            const double rgb[] = {y + 1.402 * v, y - 0.344136 * u - 0.714136 * v, y + 1.772 * u};
            for (size_t c = 0; c < 3; c++) {
                const double expected = std::min(255.0, std::max(0.0, rgb[c]));
                worst = std::max(worst, std::fabs(expected - frame.image.data[3 * i + c]));
            }
        }
        CHECK(worst < 1.0);
    }
}

TEST_CASE("YUYV of an odd width needs a complete last pair of pixels") {
    const v4l2_pixels *format = nullptr;
    for (unsigned i = 0; (format = v4l2_pixels_format(i))->fourcc != V4L2_PIX_FMT_YUYV;) {
        i++;
    }
    constexpr uint16_t kOdd = 5, kRows = 2;
    constexpr size_t kWhole = 12;  // three pairs
    const std::vector<uint8_t> bytes(kRows * kWhole, 128);
    uint16_t values[3 * kOdd * kRows];
    v4l2_pixels_source source = {bytes.data(), bytes.size(), kWhole, kOdd, kRows, true};
    CHECK(v4l2_pixels_convert(format, &source, values, 3 * kOdd) == 0);
    CHECK(values[3 * kOdd * kRows - 1] == 128);
    source.bytes -= 2;
    CHECK(v4l2_pixels_convert(format, &source, values, 3 * kOdd) == HAL_CAMERA_SHORT);
    CHECK(values[3 * kOdd * kRows - 1] == 0);
    // A driver that announces less is rejected before anything is read.
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_YUYV, kOdd, kRows);
    video->formats[0].bytes_per_line = 2 * kOdd;
    Camera camera;
    CHECK(camera.start(kOdd, kRows) == ERROR_UNSUPPORTED);
}

TEST_CASE("JPEG frames decode; damage is reported and writes no excess pixels") {
    REQUIRE(v4l2_jpeg_available());
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_MJPEG, kWidth, kHeight);
    std::vector<uint8_t> rgb;
    const std::vector<uint8_t> jpeg = jpeg_of(&rgb);
    use(video, jpeg);
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    REQUIRE(camera.look(&frame) == ERROR_OK);
    CHECK(frame.faults == 0);
    int worst = 0;
    for (size_t i = 0; i < rgb.size(); i++) {
        worst = std::max(worst, std::abs(rgb[i] - frame.image.data[i]));
    }
    CHECK(worst <= 8);
    for (size_t length : {size_t{0}, size_t{1}, size_t{100}, jpeg.size() / 2, jpeg.size() - 20}) {
        use(video, std::vector<uint8_t>(jpeg.begin(), jpeg.begin() + static_cast<long>(length)));
        REQUIRE(camera.look(&frame) == ERROR_OK);
        CHECK(frame.faults == HAL_CAMERA_DAMAGED);
    }
    std::mt19937 random(static_cast<uint32_t>(synthetic::test_seed()));
    for (int i = 0; i < 300; i++) {
        std::vector<uint8_t> bad = jpeg;
        for (int j = 0; j < 3; j++) {
            bad[random() % bad.size()] = static_cast<uint8_t>(random());
        }
        use(video, bad);
        REQUIRE(camera.look(&frame) == ERROR_OK);
        const auto max =
            *std::max_element(frame.image.data, frame.image.data + frame.image.stride * kHeight);
        CHECK(max <= 255);
    }
}

TEST_CASE("extra data of cameras does not damage a JPEG frame") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_MJPEG, kWidth, kHeight);
    Bytes rgb, marked_rgb;
    const Bytes jpeg = jpeg_of(&rgb), marked = jpeg_of(&marked_rgb, 1);
    REQUIRE(rgb == marked_rgb);
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    Bytes padded = jpeg, two = jpeg, odd_version = jpeg;
    padded.insert(padded.end(), 400, 0);
    two.insert(two.end(), jpeg.begin(), jpeg.begin() + 400);
    odd_version[marker_at(jpeg, 0xE0) + 9] = 3;
    const struct {
        std::string name;
        Bytes bytes;
    } frames[] = {{"a byte before the end", with_extra(jpeg, 0xD9, 1, 0x5A)},
                  {"a word's padding before the end", with_extra(jpeg, 0xD9, 15, 0)},
                  {"a byte before the tables", with_extra(jpeg, 0xDB, 1, 0)},
                  {"bytes before a restart", with_extra(marked, 0xD0, 10, 0x5A)},
                  {"no padding", marked},
                  {"zeros behind the end", padded},
                  {"what is left of an older frame behind the end", two},
                  {"an unknown revision of JFIF", odd_version},
                  {"no JFIF", without(jpeg, 0xE0)},
                  {"standard Huffman tables not sent", without(jpeg, 0xC4)}};
    for (const auto &frame : frames) {
        INFO(frame.name);
        const Shown shown = show(video, &camera, frame.bytes, rgb);
        CHECK(shown.faults == 0);
        CHECK(shown.worst <= 8);
    }
}

TEST_CASE("a JPEG frame with wrong pixels is reported as damaged") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_MJPEG, kWidth, kHeight);
    Bytes rgb;
    const Bytes jpeg = jpeg_of(&rgb), marked = jpeg_of(&rgb, 1);
    Camera camera;
    REQUIRE(camera.start(kWidth, kHeight) == ERROR_OK);
    const auto damaged = [&](const Bytes &bytes) {
        return show(video, &camera, bytes, {}).faults == HAL_CAMERA_DAMAGED;
    };
    const long scan = static_cast<long>(marker_at(jpeg, 0xDA)) + 14;
    const long end = static_cast<long>(jpeg.size()) - 2;
    Bytes no_end = jpeg, hole = jpeg, ones = jpeg, no_restart = marked, other_restart = marked;
    no_end.resize(jpeg.size() - 2);
    hole.erase(hole.begin() + scan + (end - scan) / 3, hole.begin() + scan + (end - scan) / 2);
    // Sixteen ones are not a Huffman code.
    for (long i = 0; i < 6; i++) {
        ones[static_cast<size_t>(scan + 40 + i)] = i % 2 == 0 ? 0xFF : 0;
    }
    const long restart = static_cast<long>(marker_at(marked, 0xD0));
    no_restart.erase(no_restart.begin() + restart, no_restart.begin() + restart + 2);
    other_restart[static_cast<size_t>(restart) + 1] = 0xD4;
    CHECK(damaged(no_end));
    CHECK(damaged(hole));
    CHECK(damaged(ones));
    CHECK(damaged(no_restart));
    CHECK(damaged(other_restart));
    // More than padding: the decoder lost synchronisation, or part of another frame was inserted.
    // (The decoder reads ahead a few bytes, which are not counted at the end.)
    CHECK(damaged(with_extra(marked, 0xD0, 17, 0x5A)));
    CHECK(damaged(with_extra(jpeg, 0xD9, 17 + 8, 0x5A)));
    CHECK_FALSE(damaged(jpeg));
}

TEST_CASE("a device that is not a camera is rejected in one line") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    video->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    {
        const Camera camera;
        CHECK(camera.opened == ERROR_UNSUPPORTED);
        CHECK(std::string(camera.text.text)
                  .find("camera /dev/video0 (Fake camera) does not stream images") == 0);
    }
    const Camera none("/dev/null");
    CHECK(none.opened == ERROR_UNSUPPORTED);
    CHECK(std::string(none.text.text).find("camera /dev/null: not a V4L2 device") == 0);
}

TEST_CASE("drivers with too little or unmappable memory or impossible sizes are rejected") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    Camera camera;
    fake_kernel_fail("mmap", 1, ENODEV, 1);
    CHECK(camera.start(kWidth, kHeight) == ERROR_UNSUPPORTED);
    CHECK(camera.log.lines.back().find("get_unmapped_area") != std::string::npos);
    video->buffers_max = 1;
    CHECK(camera.start(kWidth, kHeight) == ERROR_IO);
    CHECK(camera.log.lines.back().find("memory for only 1 frames") != std::string::npos);
    video->buffers_max = 2;
    CHECK(camera.start(kWidth, kHeight) == ERROR_OK);
    hal_camera_frame frame;
    for (int i = 0; i < 5; i++) {
        CHECK(camera.look(&frame) == ERROR_OK);
    }
    CHECK(camera.stop() == ERROR_OK);
    video->formats[0].bytes_per_line = kWidth - 1;
    CHECK(camera.start(kWidth, kHeight) == ERROR_UNSUPPORTED);
}

TEST_CASE("a driver gets as many buffers as leave room for the frames of a pair") {
    const Kernel kernel;
    const scratch folder;
    (void)fake_video_add(kVideo, V4L2_PIX_FMT_GREY, 1000, 1000);
    const auto buffers_with = [&](int free_kb) {
        folder.write("meminfo", "MemAvailable: " + std::to_string(free_kb) + " kB\n");
        REQUIRE(setenv("VERGENCE_MEMINFO", (folder / "meminfo").c_str(), 1) == 0);
        Camera camera;
        const int error = camera.start(1000, 1000);
        const std::string line = camera.log.lines.empty() ? "" : camera.log.lines.back();
        const bool refused = error == ERROR_MEMORY;
        CHECK((error == ERROR_OK || refused));
        CHECK(refused ==
              (line.find("two buffers of 1.0 MB, 2.5 MB are free") != std::string::npos));
        return refused ? 0U : camera.camera.stream.count;
    };
    CHECK(buffers_with(1 << 20) == 4);
    CHECK(buffers_with(16000) == 3);
    CHECK(buffers_with(15000) == 2);
    CHECK(buffers_with(3000) == 2);
    CHECK(buffers_with(2450) == 0);
    unsetenv("VERGENCE_MEMINFO");
}
