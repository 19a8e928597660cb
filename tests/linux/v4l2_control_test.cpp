// SPDX-License-Identifier: Apache-2.0
// Exposure, gain and focus of a V4L2 camera, and what it sets automatically.
#include "camera_harness.hpp"

namespace {

using namespace linux_harness;

constexpr uint16_t kWidth = 38, kHeight = 24;

}  // namespace

TEST_CASE("controls: automatic off, scaled to the camera's range, value read back") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    video->controls[0] = {V4L2_CID_EXPOSURE_AUTO, 0, 3, 1, 3};
    video->controls[1] = {V4L2_CID_EXPOSURE_ABSOLUTE, 3, 2047, 1, 250};
    video->controls[2] = {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, 1, 1, 1};
    video->controls[3] = {V4L2_CID_GAIN, 0, 255, 1, 64};
    Camera camera;
    record();
    int32_t applied = 0;
    CHECK(camera.control(HAL_CAMERA_EXPOSURE_US, 10040, &applied) == ERROR_OK);
    CHECK(applied == 10000);
    CHECK(record() ==
          "video0 ioctl QUERYCTRL 0x9a0902\n"
          "video0 ioctl S_CTRL 0x9a0901 = 1\n"
          "video0 ioctl S_CTRL 0x9a0903 = 0\n"
          "video0 ioctl S_CTRL 0x9a0902 = 100\n"
          "video0 ioctl G_CTRL 0x9a0902\n");
    CHECK(camera.control(HAL_CAMERA_EXPOSURE_US, 300, &applied) == ERROR_OK);
    for (const int32_t value : {0, -1, 249, 204750, 1000000, INT32_MAX, INT32_MIN}) {
        CHECK(camera.control(HAL_CAMERA_EXPOSURE_US, value, &applied) == ERROR_RANGE);
        CHECK(applied == (value < 300 ? 300 : 204700));
    }
    // In units of 100 us, a value whose time does not fit in us.
    video->controls[1] = {V4L2_CID_EXPOSURE_ABSOLUTE, 21000000, 22000000, 900000, 21000000};
    CHECK(camera.control(HAL_CAMERA_EXPOSURE_US, 2147000000, &applied) == ERROR_OK);
    CHECK(video->controls[1].value == 21900000);
    CHECK(applied == 0);
    // A camera without automatic gain is fine.
    CHECK(camera.control(HAL_CAMERA_GAIN_PART, 1000, &applied) == ERROR_OK);
    CHECK(video->controls[3].value == 255);
    CHECK(camera.control(HAL_CAMERA_GAIN_PART, 500, &applied) == ERROR_OK);
    CHECK(video->controls[3].value == 128);
    CHECK(applied == 502);
    CHECK(camera.control(HAL_CAMERA_GAIN_PART, 1001, &applied) == ERROR_RANGE);
    CHECK(camera.control(HAL_CAMERA_GAIN_PART, -1, &applied) == ERROR_RANGE);
    CHECK(camera.control(HAL_CAMERA_FOCUS_PART, 0, &applied) == ERROR_UNSUPPORTED);
    video->controls[4] = {V4L2_CID_FOCUS_ABSOLUTE, -100, 155, 5, 0};
    video->controls[5] = {V4L2_CID_FOCUS_AUTO, 0, 1, 1, 1};
    CHECK(camera.control(HAL_CAMERA_FOCUS_PART, 1000, &applied) == ERROR_OK);
    CHECK(video->controls[4].value == 155);
    CHECK(video->controls[5].value == 0);
    CHECK(camera.control(HAL_CAMERA_FOCUS_PART, 30, &applied) == ERROR_OK);
    CHECK(video->controls[4].value == -90);  // a step of the camera
    CHECK(applied == 39);
}

TEST_CASE("the current exposure is reported, unless it is automatic") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    video->controls[0] = {V4L2_CID_EXPOSURE_ABSOLUTE, 1, 100000, 1, 50000};
    Camera camera;
    record();
    int32_t applied = 7;
    CHECK(camera.control(HAL_CAMERA_EXPOSURE_FOUND_US, 0, &applied) == ERROR_OK);
    CHECK(applied == 5000000);
    CHECK(record() ==
          "video0 ioctl G_CTRL 0x9a0901\n"
          "video0 ioctl G_CTRL 0x9a0902\n");
    video->controls[1] = {V4L2_CID_EXPOSURE_AUTO, 0, 3, 1, V4L2_EXPOSURE_MANUAL};
    for (const int32_t mode : {V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL,
                               V4L2_EXPOSURE_SHUTTER_PRIORITY, V4L2_EXPOSURE_APERTURE_PRIORITY}) {
        video->controls[1].value = mode;
        const bool fixed = mode == V4L2_EXPOSURE_MANUAL || mode == V4L2_EXPOSURE_SHUTTER_PRIORITY;
        CHECK(camera.control(HAL_CAMERA_EXPOSURE_FOUND_US, 0, &applied) == ERROR_OK);
        CHECK(applied == (fixed ? 5000000 : 0));
        CHECK(video->controls[1].value == mode);
    }
    CHECK(video->controls[0].value == 50000);
    video->controls[0].id = 0;
    video->controls[1].value = V4L2_EXPOSURE_MANUAL;
    CHECK(camera.control(HAL_CAMERA_EXPOSURE_FOUND_US, 0, &applied) == ERROR_UNSUPPORTED);
}

TEST_CASE("what the camera sets automatically is switched off, and reported") {
    const Kernel kernel;
    fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
    Camera camera;
    int32_t applied = 7;
    // A camera that has nothing of this.
    CHECK(camera.control(HAL_CAMERA_AUTOMATIC_OFF, 0, &applied) == ERROR_OK);
    CHECK(applied == 0);
    CHECK(camera.control(HAL_CAMERA_FOCUS_STEPS, 0, &applied) == ERROR_OK);
    CHECK(applied == 0);
    CHECK(camera.control(HAL_CAMERA_FOCUS_FOUND_PART, 0, &applied) == ERROR_UNSUPPORTED);
    CHECK(camera.control(HAL_CAMERA_GAIN_FOUND_PART, 0, &applied) == ERROR_UNSUPPORTED);
    video->controls[0] = {V4L2_CID_EXPOSURE_AUTO, 0, 3, 1, V4L2_EXPOSURE_APERTURE_PRIORITY};
    video->controls[1] = {V4L2_CID_FOCUS_AUTO, 0, 1, 1, 1};
    video->controls[2] = {V4L2_CID_AUTO_WHITE_BALANCE, 0, 1, 1, 1};
    video->controls[3] = {V4L2_CID_FOCUS_ABSOLUTE, 0, 250, 5, 50};
    video->controls[4] = {V4L2_CID_GAIN, 0, 255, 1, 51};
    CHECK(camera.control(HAL_CAMERA_FOCUS_FOUND_PART, 0, &applied) == ERROR_UNSUPPORTED);
    CHECK(camera.control(HAL_CAMERA_AUTOMATIC_OFF, 0, &applied) == ERROR_OK);
    CHECK(applied ==
          (HAL_CAMERA_AUTO_EXPOSURE | HAL_CAMERA_AUTO_FOCUS | HAL_CAMERA_AUTO_WHITE_BALANCE));
    CHECK(video->controls[0].value == V4L2_EXPOSURE_MANUAL);
    CHECK(video->controls[1].value == 0);
    CHECK(video->controls[2].value == 0);
    CHECK(camera.control(HAL_CAMERA_AUTOMATIC_OFF, 0, &applied) == ERROR_OK);
    CHECK(applied == 0);
    CHECK(camera.control(HAL_CAMERA_FOCUS_STEPS, 0, &applied) == ERROR_OK);
    CHECK(applied == 50);
    CHECK(camera.control(HAL_CAMERA_FOCUS_FOUND_PART, 0, &applied) == ERROR_OK);
    CHECK(applied == 200);
    CHECK(camera.control(HAL_CAMERA_GAIN_FOUND_PART, 0, &applied) == ERROR_OK);
    CHECK(applied == 200);
    // A driver that does not allow it.
    video->controls[1].value = 1;
    fake_kernel_fail("S_CTRL", 1, EACCES, 1);
    CHECK(camera.control(HAL_CAMERA_AUTOMATIC_OFF, 0, &applied) == ERROR_OK);
    CHECK(applied == (HAL_CAMERA_AUTO_FOCUS | HAL_CAMERA_AUTO_FOCUS << HAL_CAMERA_AUTO_STILL));
    fake_kernel_fail("G_CTRL", 2, ENODEV, 1);
    CHECK(camera.control(HAL_CAMERA_AUTOMATIC_OFF, 0, &applied) == ERROR_DEVICE);
}

TEST_CASE("each call of a control fails in turn") {
    const struct {
        int system, ours;
    } pairs[] = {{EINVAL, ERROR_UNSUPPORTED},
                 {ENOTTY, ERROR_UNSUPPORTED},
                 {ERANGE, ERROR_RANGE},
                 {ENODEV, ERROR_DEVICE},
                 {EIO, ERROR_IO},
                 {EBUSY, ERROR_IO}};
    for (const auto &pair : pairs) {
        for (unsigned nth = 1; nth <= 4; nth++) {
            const Kernel kernel;
            fake_video *video = fake_video_add(kVideo, V4L2_PIX_FMT_GREY, kWidth, kHeight);
            video->controls[0] = {V4L2_CID_GAIN, 0, 255, 1, 64};
            video->controls[1] = {V4L2_CID_AUTOGAIN, 0, 1, 1, 1};
            Camera camera;
            int32_t applied = -5;
            fake_kernel_fail("", nth, pair.system, 1);
            const int error = camera.control(HAL_CAMERA_GAIN_PART, 10, &applied);
            // A missing automatic control is not an error.
            CHECK(error == (nth == 2 && pair.ours == ERROR_UNSUPPORTED ? ERROR_OK : pair.ours));
            CHECK((error == ERROR_OK) == (applied != -5));
        }
    }
}
