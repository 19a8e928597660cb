// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/rig/ppi_port.hpp"

#include <algorithm>
#include <utility>

namespace simrig {

void PpiPort::arm(unsigned columns, unsigned rows) {
    frame_ = PpiFrame();
    frame_.columns = columns;
    frame_.rows = rows;
    frame_.pixels.assign(size_t(columns) * rows, 0);
    armed_ = true;
    taking_ = done_ = false;
}

void PpiPort::cancel() {
    armed_ = taking_ = done_ = false;
}

PpiFrame PpiPort::take() {
    armed_ = done_ = false;
    return std::move(frame_);
}

void PpiPort::end_line() {
    frame_.short_line = frame_.short_line || column_ != frame_.columns;
    row_++;
    column_ = 0;
}

void PpiPort::take_pixels(const uint16_t *data, size_t count) {
    if (row_ < frame_.rows && column_ < frame_.columns) {
        const size_t fits = std::min<size_t>(count, frame_.columns - column_);
        std::copy(data, data + fits, &frame_.pixels[size_t(row_) * frame_.columns + column_]);
    }
    column_ += unsigned(count);
}

// The run that ends had the stored syncs; the present sample begins another one.
void PpiPort::on_run(uint64_t time_ps, const uint16_t *data, size_t count,
                     const bridge_outputs &now) {
    const bool frame_valid = now.ppi_fs2 != 0, line_valid = now.ppi_fs1 != 0;
    if (taking_ && line_valid_) {
        take_pixels(data, count);
    }
    if (frame_valid && !frame_valid_) {
        frames_++;
        taking_ = armed_ && !done_;
        if (taking_) {
            frame_.begin_ps = time_ps;
            frame_.number = frames_;
        }
        row_ = column_ = 0;
    }
    if (taking_) {
        if (line_valid_ && !line_valid) {
            end_line();
        }
        if (!frame_valid) {
            frame_.short_frame = row_ < frame_.rows;
            frame_.long_frame = row_ > frame_.rows;
            frame_.end_ps = time_ps;
            taking_ = false;
            done_ = true;
            wires_.stop();
        }
    }
    frame_valid_ = frame_valid;
    line_valid_ = line_valid;
}

}  // namespace simrig
