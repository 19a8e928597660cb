// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/session_calibration.hpp"

#include <string>

#include "console/pair/calibration_fit.h"
#include "core/error.h"
#include "daemon/session/calibration_read.h"
#include "daemon/surface/reconstruct_session.h"
#include "device/mt9t001.h"
#include "tools/host/convert/calibration_file.hpp"
#include "tools/host/formats/whole_file.hpp"

namespace {

/// The file that the user names, else the pair's own.
int read_calibration(const session_reader &reader, const session_pairs &pairs,
                     const std::string &path, calibration *value, message *last_error) {
    if (path.empty()) {
        if (!pairs.has_calibration) {
            return message_set(last_error, ERROR_MISSING,
                               "no calibration in the session (name one by --calibration)");
        }
        std::string text(CALIBRATION_TEXT_MAX_BYTES, '\0');
        const int length = session_reader_calibration(&reader, pairs.calibration_crc, &text[0],
                                                      text.size(), last_error);
        return length < 0 ? length
                          : calibration_at("the session's calibration", text.data(),
                                           static_cast<std::size_t>(length), value, last_error);
    }
    std::string text, reason;
    if (whole_file_read(path, CALIBRATION_AT_TEXT_BYTES, "a calibration", &text, &reason) == 0 &&
        zoom_calibration_is_text(text.data(), text.size())) {
        calibration_match_state state;
        calibration_match_pair(pairs.pair.profile,
                               pairs.has_instrument ? &pairs.instrument : nullptr, &pairs.pair.pair,
                               &state);
        return calibration_read_for_pair(path.c_str(), text.data(), text.size(), &state, value,
                                         last_error);
    }
    const raw_image &left = pairs.pair.pair.frame[0].image;
    char format[CALIBRATION_LOADER_FORMAT_BYTES];
    const calibration_request request = {path.c_str(), left.width_px, left.height_px,
                                         nullptr,      false,         -1};
    return calibration_file_loader(&request, value, format, last_error);
}

}  // namespace

int session_calibration(const session_reader &reader, const session_pairs &pairs, const char *path,
                        int shrink, calibration *value, message *last_error) {
    const int code = read_calibration(reader, pairs, path, value, last_error);
    for (int side = 0; side < 2 && code == ERROR_OK; side++) {
        lens &view = side == 0 ? value->left : value->right;
        const raw_image &image = pairs.pair.pair.frame[side].image;
        const pair_window &window = pairs.pair.pair.frame[side].window;
        if (view.width_px == MT9T001_WIDTH_PX && view.height_px == MT9T001_HEIGHT_PX &&
            window.skip > 0) {
            view = calibration_fit_lens(&view, &window, image.width_px, image.height_px);
        }
        if (view.width_px != image.width_px || view.height_px != image.height_px) {
            return message_set(last_error, ERROR_SIZE_MISMATCH,
                               "the calibration is for %dx%d px, the frames have %dx%d",
                               view.width_px, view.height_px, image.width_px, image.height_px);
        }
        if (shrink > 1) {
            view = reconstruct_session_shrink(&view, shrink);
        }
    }
    if (code == ERROR_OK) {
        value->has_origin = false;
    }
    return code;
}
