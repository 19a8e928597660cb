// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/mt9t001.hpp"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace simrig {

namespace {

// What decides when each row of a frame is read.
auto timing_of(const SensorFrame &frame) {
    return std::tie(frame.row_start, frame.column_start, frame.height, frame.width,
                    frame.row_clocks, frame.skip_rows, frame.bin_rows, frame.skip_columns,
                    frame.bin_columns);
}

constexpr unsigned kArrayRows = 1568, kArrayColumns = 2112;
constexpr uint16_t kBlackLevel = 42;

struct Row {
    uint8_t index;
    uint16_t reset, stored;  // bits that a write keeps
};

constexpr Row kRows[] = {{Mt9t001::kRowStart, 20, 0x07FF},
                         {Mt9t001::kColumnStart, 32, 0x0FFF},
                         {Mt9t001::kRowSize, 1535, 0x07FF},
                         {Mt9t001::kColumnSize, 2047, 0x0FFF},
                         {Mt9t001::kHorizontalBlanking, 142, 0x07FF},
                         {Mt9t001::kVerticalBlanking, 25, 0x07FF},
                         {Mt9t001::kOutputControl, 2, 0x00FF},
                         {Mt9t001::kShutterWidthHigh, 0, 0x000F},
                         {Mt9t001::kShutterWidth, 1561, 0xFFFF},
                         {Mt9t001::kPixelClockControl, 0, 0x87FF},
                         {Mt9t001::kShutterDelay, 0, 0x07FF},
                         {Mt9t001::kReset, 0, 0x0001},
                         {Mt9t001::kReadMode1, 0x8040, 0xFFFF},
                         {Mt9t001::kReadMode2, 0, 0xFFFF},
                         {0x21, 0, 0x0003},
                         {Mt9t001::kRowAddressMode, 0, 0x0077},
                         {Mt9t001::kColumnAddressMode, 0, 0x0077},
                         {Mt9t001::kGreen1Gain, 8, 0x7F7F},
                         {Mt9t001::kBlueGain, 8, 0x7F7F},
                         {Mt9t001::kRedGain, 8, 0x7F7F},
                         {Mt9t001::kGreen2Gain, 8, 0x7F7F},
                         {Mt9t001::kTestData, 0, 0x0FFC},
                         {Mt9t001::kGlobalGain, 8, 0x7F7F},
                         {0x49, 0x00A8, 0x0FFC},
                         {0x4B, 0, 0x07FF},
                         {0x4E, 0, 0xFFFF},
                         {0x5D, 0x2D13, 0xFFFF},
                         {0x5F, 0x231D, 0xFFFF},
                         {0x60, 32, 0x01FF},
                         {0x61, 32, 0x01FF},
                         {0x62, 0, 0x7FFF},
                         {0x63, 32, 0x01FF},
                         {0x64, 32, 0x01FF}};

const Row *row_of(uint8_t index) {
    for (const Row &row : kRows) {
        if (row.index == index) {
            return &row;
        }
    }
    return nullptr;
}

// Minimum time of a row; a constant of Elphel's drivers for this sensor.
constexpr unsigned kShortestRowClocks = 511;

// Pixel clocks of a row besides columns and blanking, by binning of rows and of columns: measured
// for the drivers of Elphel's cameras.
unsigned row_overhead(unsigned bin_rows) {
    constexpr unsigned kClocks[] = {331, 673, 999};
    return kClocks[std::min(bin_rows, 3u) - 1];
}
unsigned column_overhead(unsigned bin_columns) {
    constexpr unsigned kClocks[] = {38, 22, 14};
    return kClocks[std::min(bin_columns, 3u) - 1];
}

// Steps of 1/8 in the first stage, doubled by the second; digital ones on top.
double analog_gain(uint16_t code) {
    return (code & 0x3Fu) / 8.0 * ((code & 0x40u) != 0 ? 2 : 1);
}
double digital_gain(uint16_t code) {
    return 1 + (code >> 8 & 0x7Fu) / 8.0;
}

}  // namespace

Mt9t001::Mt9t001(FrameSource source) : source_(std::move(source)) {
    reset_registers();
}

void Mt9t001::reset_registers() {
    registers_.fill(0);
    for (const Row &row : kRows) {
        registers_[row.index] = row.reset;
    }
    latched_ = registers_;
    light_now_ = light_next_ = light();
    stop();
    triggered_ = false;
}

// Abandons the frame in progress and restarts.
void Mt9t001::stop() {
    state_ = State::kStopped;
    row_ = clock_ = 0;
    begun_ = false;
    restart_ = true;
}

void Mt9t001::write(uint8_t index, uint16_t value) {
    if (!pins_.reset_n) {
        return;
    }
    if (index == kChipEnable) {
        // A mirror of two bits of the output control.
        index = kOutputControl;
        value = uint16_t((registers_[index] & ~3u) | (value & 1u) << 1 | (value >> 1 & 1u));
    }
    if (index == kFrameRestart) {
        restart_ = restart_ || (value & 1u) != 0;
        return;
    }
    const Row *row = row_of(index);
    if (row == nullptr) {
        return;
    }
    const uint16_t stored = value & row->stored;
    if (index == kReset && stored != 0) {
        reset_registers();
    } else if (index == kReset) {
        restart_ = true;
    } else if (index == kGlobalGain) {
        for (uint8_t gain = kGreen1Gain; gain <= kGreen2Gain; gain++) {
            registers_[gain] = stored;
        }
    }
    registers_[index] = stored;
}

uint16_t Mt9t001::read(uint8_t index) const {
    if (index == kChip) {
        return kChipVersion;
    }
    if (index == kChipEnable) {
        const unsigned control = registers_[kOutputControl];
        return uint16_t((control >> 1 & 1u) | (control & 1u) << 1);
    }
    return registers_[index];
}

void Mt9t001::set_pins(const Pins &pins) {
    if (!pins.reset_n && pins_.reset_n) {
        reset_registers();
    }
    if ((pins.standby && !pins_.standby) || !pins.clock_in) {
        stop();
    }
    pins_ = pins;
}

unsigned Mt9t001::clock_divider() const {
    const unsigned divide = registers_[kPixelClockControl] & 0x7Fu;
    if (!pins_.reset_n || pins_.standby || !pins_.output_enable || !pins_.clock_in) {
        return 0;
    }
    return divide == 0 ? 1 : 2 * divide;
}

Mt9t001::Light Mt9t001::light() const {
    Light light;
    light.shutter_rows = unsigned(latched_[kShutterWidthHigh]) << 16 | latched_[kShutterWidth];
    light.shutter_rows = std::max(light.shutter_rows, 1u);
    light.shutter_delay = latched_[kShutterDelay];
    light.gain = {latched_[kGreen1Gain], latched_[kRedGain], latched_[kBlueGain],
                  latched_[kGreen2Gain]};
    return light;
}

SensorFrame Mt9t001::plan(double period_us) const {
    SensorFrame frame;
    const auto bits = [this](Register index, unsigned shift) {
        return (latched_[index] >> shift & 7u) + 1;
    };
    frame.row_start = latched_[kRowStart] & ~1u;
    frame.column_start = latched_[kColumnStart] & ~1u;
    frame.height = std::min(latched_[kRowSize] + 1u, kArrayRows - std::min(frame.row_start, 1566u));
    frame.width = std::min((latched_[kColumnSize] | 1u) + 1,
                           kArrayColumns - std::min(frame.column_start, 2110u));
    frame.skip_rows = bits(kRowAddressMode, 0);
    frame.skip_columns = bits(kColumnAddressMode, 0);
    frame.bin_rows = std::min(bits(kRowAddressMode, 4), frame.skip_rows);
    frame.bin_columns = std::min(bits(kColumnAddressMode, 4), frame.skip_columns);
    frame.flip_rows = (latched_[kReadMode2] & 0x8000u) != 0;
    frame.flip_columns = (latched_[kReadMode2] & 0x4000u) != 0;
    frame.rows = std::max(frame.height / frame.skip_rows, 1u);
    frame.columns = std::max(frame.width / frame.skip_columns, 1u);
    const unsigned overhead = row_overhead(frame.bin_rows);
    frame.row_clocks =
        std::max(kShortestRowClocks, frame.columns + overhead + column_overhead(frame.bin_columns) +
                                         std::max<unsigned>(latched_[kHorizontalBlanking], 21));
    frame.shutter_rows = light_now_.shutter_rows;
    frame.shutter_delay_clocks = light_now_.shutter_delay;
    // The following rows are exposed meanwhile: a long exposure makes the frame longer.
    const unsigned frame_rows =
        std::max(frame.rows + std::max<unsigned>(latched_[kVerticalBlanking], 3) + 1,
                 light_next_.shutter_rows + 1);
    frame.blank_rows = frame_rows - frame.rows;
    frame.row_us = frame.row_clocks * period_us;
    const double clocks =
        double(frame.shutter_rows) * frame.row_clocks - overhead - frame.shutter_delay_clocks;
    frame.exposure_us = std::max(clocks, 0.0) * period_us;
    for (size_t i = 0; i < light_now_.gain.size(); i++) {
        frame.analog_gain[i] = analog_gain(light_now_.gain[i]);
        frame.digital_gain[i] = digital_gain(light_now_.gain[i]);
    }
    frame.test_data = (latched_[kOutputControl] & 0x40u) != 0;
    frame.test_value = latched_[kTestData] >> 2;
    return frame;
}

uint64_t Mt9t001::frame_clocks(const SensorFrame &frame) {
    return uint64_t(frame.row_clocks) * (frame.rows + frame.blank_rows);
}

void Mt9t001::latch() {
    if ((registers_[kOutputControl] & 1u) == 0) {
        latched_ = registers_;
    }
}

// True if no frame is read now: the sensor is stopped, or begins an exposure.
bool Mt9t001::waits_before_frame(double period_us) {
    const bool snapshot = (registers_[kReadMode1] & 0x0100u) != 0;
    const bool enabled = (registers_[kOutputControl] & 2u) != 0 && registers_[kReset] == 0;
    const bool go = snapshot ? triggered_ || restart_ : true;
    if (!enabled || !go) {
        state_ = State::kStopped;
        row_clocks_ = 1;
        return true;
    }
    if (!snapshot && !restart_) {
        return false;
    }
    latch();
    light_now_ = light_next_ = light();
    const SensorFrame next = plan(period_us);
    row_clocks_ = next.row_clocks;
    rows_to_wait_ = light_now_.shutter_rows;
    restart_ = triggered_ = false;
    state_ = State::kExposing;
    return true;
}

// After a restart the rows are empty: one exposure, then a good frame.
void Mt9t001::begin_frame(double period_us) {
    const bool from_idle = state_ != State::kReading;
    row_ = clock_ = 0;
    if (state_ != State::kExposing && waits_before_frame(period_us)) {
        return;
    }
    const SensorFrame before = frame_;
    latch();
    const Light asked = light();
    const bool other_shutter = asked.shutter_rows != light_next_.shutter_rows;
    if (!from_idle) {
        light_now_ = light_next_;
    }
    light_next_ = asked;
    frame_ = plan(period_us);
    frame_.number = frames_++;
    // The rows of this frame were exposed with other times between them than they are read with.
    frame_.bad = !from_idle && (other_shutter || timing_of(before) != timing_of(frame_));
    frame_.shown = !frame_.bad || (latched_[kReadMode2] & 1u) != 0;
    state_ = State::kReading;
    row_clocks_ = frame_.row_clocks;
    frame_rows_ = frame_.rows + frame_.blank_rows;
    lead_clocks_ =
        frame_.row_clocks - frame_.columns - std::max<unsigned>(latched_[kHorizontalBlanking], 21);
    pixels_.clear();
    line_ = nullptr;
}

void Mt9t001::begin_if_due(double period_us) {
    if (restart_ && state_ != State::kStopped) {
        state_ = State::kStopped;  // the frame, or its exposure, is abandoned at once
        row_ = clock_ = 0;
        begun_ = false;
    }
    if (row_ == 0 && clock_ == 0 && state_ != State::kExposing && !begun_) {
        begin_frame(period_us);
        begun_ = state_ == State::kReading;
    }
}

void Mt9t001::run(double now_us, double period_us, std::vector<uint16_t> &words) {
    begin_if_due(period_us);
    if (state_ == State::kStopped) {
        words.assign(1, 0);
        return;
    }
    begun_ = false;
    if (state_ == State::kExposing || !frame_.shown || row_ >= frame_.rows) {
        words.assign(row_clocks_ - clock_, 0);
        end_row();
    } else if (clock_ < lead_clocks_) {
        // A frame is rendered only when its first pixel is due.
        words.assign(lead_clocks_ - clock_, kFrameValid);
        clock_ = lead_clocks_;
        return;
    } else {
        const unsigned first = clock_ - lead_clocks_;
        words.assign(row_clocks_ - clock_, row_ + 1 < frame_.rows ? kFrameValid : 0);
        if (first == 0) {
            begin_row(now_us);
        }
        for (unsigned column = first; column < frame_.columns; column++) {
            const unsigned pixel = line_ != nullptr ? line_[column] : kBlackLevel;
            words[column - first] = uint16_t(kFrameValid | kLineValid | pixel);
        }
        end_row();
    }
    if (state_ == State::kExposing && rows_to_wait_ == 0) {
        begin_frame(period_us);
        begun_ = true;
    }
}

uint64_t Mt9t001::clocks_to_frame() const {
    if (state_ == State::kStopped) {
        return restart_ ? 0 : std::numeric_limits<uint64_t>::max();
    }
    if (restart_ && state_ != State::kStopped) {
        return 0;
    }
    if (row_ == 0 && clock_ == 0 && state_ == State::kReading) {
        return 0;
    }
    const unsigned rows = state_ == State::kExposing ? rows_to_wait_ : frame_rows_ - row_;
    return uint64_t(rows) * row_clocks_ - clock_;
}

bool Mt9t001::begins_frame() const {
    return state_ == State::kReading && frame_.shown && row_ == 0 && clock_ == lead_clocks_;
}

void Mt9t001::skip(uint64_t clocks, double period_us) {
    while (clocks > 0) {
        begin_if_due(period_us);
        if (state_ == State::kStopped) {
            return;
        }
        begun_ = false;
        // Whole rows at once: to the end of the frame or of the exposure.
        const unsigned rows = state_ == State::kExposing ? rows_to_wait_ : frame_rows_ - row_;
        const uint64_t to_end = uint64_t(rows) * row_clocks_ - clock_;
        const uint64_t step = std::min(clocks, to_end);
        const uint64_t at = clock_ + step;
        clocks -= step;
        clock_ = unsigned(at % row_clocks_);
        const auto rows_done = unsigned(at / row_clocks_);
        if (state_ == State::kExposing) {
            rows_to_wait_ -= rows_done;
            if (rows_to_wait_ == 0) {
                begin_frame(period_us);
                begun_ = true;
            }
        } else {
            row_ = step == to_end ? 0 : row_ + rows_done;
        }
        line_ = nullptr;
        pixels_.clear();
    }
}

void Mt9t001::begin_row(double now_us) {
    if (row_ == 0) {
        if (frame_.test_data) {
            pixels_.assign(size_t(frame_.rows) * frame_.columns, uint16_t(frame_.test_value));
        } else if (wanted()) {
            pixels_ = source_(frame_, now_us);
        }
    }
    const size_t at = size_t(row_) * frame_.columns;
    line_ = pixels_.size() >= at + frame_.columns ? &pixels_[at] : nullptr;
}

void Mt9t001::end_row() {
    clock_ = 0;
    if (state_ == State::kExposing) {
        rows_to_wait_--;
        return;
    }
    row_ = state_ == State::kStopped || row_ + 1 >= frame_rows_ ? 0 : row_ + 1;
}

}  // namespace simrig
