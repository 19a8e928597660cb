// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/frame_messages.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "core/error.h"
#include "daemon/cli/options.h"
#include "daemon/images/picture.h"
#include "tools/host/convert/export.hpp"

namespace {

const char *encoding_of(raw_layout layout, bool wide) {
    switch (layout) {
        case RAW_GREY:
            return wide ? "mono16" : "mono8";
        case RAW_RGB:
            return wide ? "rgb16" : "rgb8";
        default:
            return wide ? "bayer_grbg16" : "bayer_grbg8";
    }
}

}  // namespace

ros_image frame_raw_message(const raw_image &image) {
    const bool wide = image.bits > 8;
    ros_image out;
    out.width_px = static_cast<uint32_t>(image.width_px);
    out.height_px = static_cast<uint32_t>(image.height_px);
    out.encoding = encoding_of(image.layout, wide);
    const size_t row_values = raw_image_row_values(&image);
    out.row_bytes = static_cast<uint32_t>(row_values * (wide ? 2 : 1));
    out.data.reserve(static_cast<size_t>(out.row_bytes) * out.height_px);
    for (int y = 0; y < image.height_px; y++) {
        const uint16_t *const row = raw_image_row(&image, y);
        for (size_t i = 0; i < row_values; i++) {
            const unsigned value = static_cast<unsigned>(row[i]) << (wide ? 16 - image.bits : 0);
            out.data += static_cast<char>(value & 0xFF);
            if (wide) {
                out.data += static_cast<char>(value >> 8);
            }
        }
    }
    return out;
}

ros_image frame_compressed_message(const raw_image &image, const develop_balance &balance) {
    picture shown{};
    shown.width_px = image.width_px;
    shown.height_px = image.height_px;
    shown.channels = image.layout == RAW_GREY ? 1 : 3;
    shown.row_bytes = static_cast<size_t>(shown.width_px) * static_cast<size_t>(shown.channels);
    std::vector<uint8_t> pixels(shown.row_bytes * static_cast<size_t>(shown.height_px));
    shown.pixels = pixels.data();
    const int code = picture_develop(&image, &balance, 1, &shown);
    size_t bytes = 0;
    uint8_t *const png = code == ERROR_OK ? picture_png(&shown, &bytes) : nullptr;
    if (png == nullptr) {
        throw frame_failure{code == ERROR_ARGUMENT ? CLIENT_BAD_INPUT : CLIENT_FAILED,
                            std::string("a frame cannot be compressed: ") +
                                error_text(code == ERROR_OK ? ERROR_MEMORY : code)};
    }
    ros_image out;
    out.encoding =
        shown.channels == 1 ? "mono8; png compressed mono8" : "rgb8; png compressed bgr8";
    out.data.assign(reinterpret_cast<const char *>(png), bytes);
    std::free(png);
    return out;
}

ros_camera_info frame_camera_info(const lens &camera, const double R[9], const double P[12]) {
    ros_camera_info info;
    info.width_px = static_cast<uint32_t>(camera.width_px);
    info.height_px = static_cast<uint32_t>(camera.height_px);
    info.model = export_ros_model(camera);
    info.D = export_coefficients(camera);
    const double K[9] = {camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1};
    std::copy(K, K + 9, info.K);
    std::copy(R, R + 9, info.R);
    std::copy(P, P + 12, info.P);
    return info;
}
