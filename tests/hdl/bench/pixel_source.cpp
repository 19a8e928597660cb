// SPDX-License-Identifier: Apache-2.0
#include "pixel_source.hpp"

#include <algorithm>

namespace hdl {

uint16_t pixel_of(int camera, uint32_t frame, unsigned x, unsigned y) {
    if (y == 0 && x == 0) {
        return uint16_t(unsigned(camera) << 9 | (frame >> 10 & 0x1FFu));
    }
    if (y == 0 && x == 1) {
        return uint16_t(frame & 0x3FFu);
    }
    uint32_t word = (frame * 2 + uint32_t(camera)) * 0x9E3779B1u ^ (y << 16 | x);
    word = (word ^ word >> 16) * 0x85EBCA6Bu;
    word = (word ^ word >> 13) * 0xC2B2AE35u;
    return uint16_t((word ^ word >> 16) & 0x3FFu);
}

PixelSource::PixelSource(Bridge &bridge, int camera, const Window &window)
    : bridge_(bridge), camera_(camera), window_(window), next_window_(window) {
    bridge_.add(*this);
}

void PixelSource::set_period(uint32_t period_ps) {
    period_ps_ = period_ps;
    bridge_.set_clock(camera_, period_ps);
}

void PixelSource::on_pixel_clock(uint64_t, int camera, int level) {
    if (camera != camera_) {
        return;
    }
    if ((level != 0) == launch_at_fall) {
        if (only_at_edge) {
            bridge_.in.pixel[camera_] ^= 0x3FFu;
            bridge_.drive();
        }
        return;
    }
    if (++column_ >= window_.row_clocks()) {
        column_ = 0;
        if (++row_ >= window_.frame_rows()) {
            row_ = 0;
            frame_ = (frame_ + 1) % kFrameNumbers;
            window_ = next_window_;
            short_by_ = missing_pixels;
            lines_short_by_ = missing_lines;
            missing_pixels = missing_lines = 0;
        }
    }
    // The frame begins shortly before its first line, and ends after its last.
    const unsigned lead = 8;
    const bool frame_valid =
        row_ < window_.height - lines_short_by_ && (row_ != 0 || column_ >= lead) &&
        (row_ + 1 != window_.height - lines_short_by_ || column_ < window_.width + 2 * lead + 8);
    const unsigned x = column_ - 2 * lead;
    const unsigned width = window_.width - (row_ == 2 ? short_by_ : 0);
    const bool line_valid = frame_valid && column_ >= 2 * lead && x < width;
    bridge_.in.frame_valid[camera_] = frame_valid;
    bridge_.in.line_valid[camera_] = line_valid;
    // Between lines the pins carry data too.
    bridge_.in.pixel[camera_] =
        line_valid ? pixel_of(camera_, frame_, x, row_) : uint16_t(column_ * 37u & 0x3FFu);
    bridge_.drive();
}

PpiReceiver::PpiReceiver(Bridge &bridge) {
    bridge.add(*this);
}

void PpiReceiver::on_event(uint64_t time_ps, uint32_t, const bridge_outputs &now) {
    uint64_t &shortest = now.ppi_clk ? shortest_low_ps : shortest_high_ps;
    if (edges++ > 0) {
        shortest = std::min(shortest, time_ps - edge_ps_);
    }
    edge_ps_ = time_ps;
    if (!now.ppi_clk) {
        return;
    }
    // Data change at the fall, so at the rise they have been stable for half a period.
    const bool frame_valid = now.ppi_fs2 != 0, line_valid = now.ppi_fs1 != 0;
    if (now.ppi_fs3 || (line_valid && !frame_valid)) {
        broken++;
    }
    if (frame_valid && !in_frame_) {
        frames.push_back({time_ps, 0, {}});
    }
    if (!frame_valid && in_frame_) {
        frames.back().end_ps = time_ps;
    }
    if (line_valid && frame_valid) {
        if (!in_line_) {
            frames.back().lines.emplace_back();
        }
        frames.back().lines.back().push_back(now.ppi_data);
    }
    in_frame_ = frame_valid;
    in_line_ = line_valid;
}

std::string check_frame(const Received &frame, const Window &window, int &camera,
                        uint32_t &number) {
    camera = -1;
    if (frame.lines.size() != window.height) {
        return std::to_string(frame.lines.size()) + " lines";
    }
    for (size_t y = 0; y < frame.lines.size(); y++) {
        if (frame.lines[y].size() != window.width) {
            return "line " + std::to_string(y) + " has " + std::to_string(frame.lines[y].size()) +
                   " pixels";
        }
    }
    camera = frame.lines[0][0] >> 9;
    number = uint32_t(frame.lines[0][0] & 0x1FFu) << 10 | frame.lines[0][1];
    for (unsigned y = 0; y < window.height; y++) {
        for (unsigned x = 0; x < window.width; x++) {
            if (frame.lines[y][x] != pixel_of(camera, number, x, y)) {
                return "camera " + std::to_string(camera) + " frame " + std::to_string(number) +
                       ": pixel " + std::to_string(x) + "," + std::to_string(y) + " is wrong";
            }
        }
    }
    return "";
}

}  // namespace hdl
