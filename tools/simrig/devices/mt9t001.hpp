// SPDX-License-Identifier: Apache-2.0
/// The image sensor Micron MT9T001 as seen from its pins and I2C registers: which frames it
/// outputs, when, of which part of the array, and with which exposure and gain. A FrameSource
/// supplies the pixels.
///
/// Registers and times: the sensor's data as collected in Linux's mt9t001.c and mt9t031.c, Elphel's
/// mt9x001.c, and measurements of cameras with it. Comments mark what these leave open.
#ifndef VERGENCE_SIMRIG_DEVICES_MT9T001_HPP
#define VERGENCE_SIMRIG_DEVICES_MT9T001_HPP

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace simrig {

/// What is in force for one frame.
struct SensorFrame {
    uint64_t number = 0;                       ///< frames since power-up, bad ones included
    unsigned row_start = 0, column_start = 0;  ///< first row and column of the physical array
    unsigned height = 0, width = 0;            ///< rows and columns read, before skipping
    unsigned skip_rows = 1, skip_columns = 1, bin_rows = 1, bin_columns = 1;
    bool flip_rows = false, flip_columns = false;
    unsigned rows = 0, columns = 0;  ///< size of the output image
    unsigned row_clocks = 0;         ///< pixel clocks from row to row
    unsigned blank_rows = 0;         ///< blank rows from the last image row to the next frame
    unsigned shutter_rows = 0;
    unsigned shutter_delay_clocks = 0;
    double exposure_us = 0;  ///< exposure of each row
    double row_us = 0;
    /// Green of red rows, red, blue, green of blue rows.
    std::array<double, 4> analog_gain{}, digital_gain{};
    bool test_data = false;
    unsigned test_value = 0;  ///< 10 bits
    bool bad = false;         ///< window or blanking changed during it: invalid
    bool shown = true;        ///< false: a bad frame that is not output
};

/// Returns the image of a frame: rows * columns numbers of 10 bits, row by row. begin_us: when the
/// first row's pixels leave the sensor; the exposure of row r ended at begin_us + r * row_us.
using FrameSource = std::function<std::vector<uint16_t>(const SensorFrame &frame, double begin_us)>;

class Mt9t001 {
  public:
    static constexpr uint8_t kAddress = 0x5D;
    static constexpr uint16_t kChipVersion = 0x1621;

    /// Registers, by the names of the Linux driver.
    enum Register : uint8_t {
        kChip = 0x00,
        kRowStart = 0x01,
        kColumnStart = 0x02,
        kRowSize = 0x03,
        kColumnSize = 0x04,
        kHorizontalBlanking = 0x05,
        kVerticalBlanking = 0x06,
        kOutputControl = 0x07,
        kShutterWidthHigh = 0x08,
        kShutterWidth = 0x09,
        kPixelClockControl = 0x0A,
        kFrameRestart = 0x0B,
        kShutterDelay = 0x0C,
        kReset = 0x0D,
        kReadMode1 = 0x1E,
        kReadMode2 = 0x20,
        kRowAddressMode = 0x22,
        kColumnAddressMode = 0x23,
        kGreen1Gain = 0x2B,
        kBlueGain = 0x2C,
        kRedGain = 0x2D,
        kGreen2Gain = 0x2E,
        kTestData = 0x32,
        kGlobalGain = 0x35,
        kChipEnable = 0xF8
    };

    explicit Mt9t001(FrameSource source);

    // ---- I2C, as the two-wire interface decodes it
    void write(uint8_t index, uint16_t value);
    uint16_t read(uint8_t index) const;

    // ---- pins
    struct Pins {
        bool reset_n = true, standby = false, output_enable = true, clock_in = true;
    };
    void set_pins(const Pins &pins);
    /// A pulse on the trigger pin: begins a frame in snapshot mode.
    void trigger() { triggered_ = true; }
    /// Pixel clocks per clock of the input; 0: the output clock is stopped.
    unsigned clock_divider() const;
    /// Data changes after the rising edge of the pixel clock, to be sampled at the falling edge;
    /// inverted: the other way round.
    bool clock_inverted() const { return (registers_[kPixelClockControl] & 0x8000u) != 0; }

    /// Output for some pixel clocks: data and these bits.
    enum : uint16_t { kLineValid = 1u << 10, kFrameValid = 1u << 11 };
    /// The next pixel clocks, up to the end of a row at most; at least one. words is replaced,
    /// one word per clock. now_us: time of the first; period_us: of the pixel clock. Before the
    /// first pixel of a frame wanted() decides whether the frame is rendered; if not, the pixels
    /// are those of an unlit sensor.
    void run(double now_us, double period_us, std::vector<uint16_t> &words);
    std::function<bool()> wanted = [] { return true; };
    /// Pixel clocks until the next frame may begin; the largest number: not before a register
    /// write or a pin change.
    uint64_t clocks_to_frame() const;
    /// At the first pixel clock of a frame that is shown.
    bool begins_frame() const;
    /// Skips so many pixel clocks without output; frames pass in them.
    void skip(uint64_t clocks, double period_us);

    /// The frame that is being read out, or was last.
    const SensorFrame &frame() const { return frame_; }
    /// Clocks from a frame's first row to the next one's.
    static uint64_t frame_clocks(const SensorFrame &frame);

  private:
    // Pending exposure and gain: written during frame n, in force from frame n + 2.
    struct Light {
        unsigned shutter_rows = 0, shutter_delay = 0;
        std::array<uint16_t, 4> gain{};
    };
    enum class State { kStopped, kExposing, kReading };

    void reset_registers();
    void stop();
    Light light() const;
    void expose(const Light &light);
    void latch();
    SensorFrame plan(double period_us) const;
    bool waits_before_frame(double period_us);
    void begin_frame(double period_us);
    void begin_if_due(double period_us);
    void end_row();
    void begin_row(double now_us);

    FrameSource source_;
    std::array<uint16_t, 256> registers_{};
    std::array<uint16_t, 256> latched_{};  // what the timing uses: not while frozen
    Pins pins_;
    State state_ = State::kStopped;
    bool triggered_ = false, restart_ = false;
    bool begun_ = false;  // the frame at its first clock has been started already
    Light light_now_, light_next_;
    SensorFrame frame_;
    std::vector<uint16_t> pixels_;
    const uint16_t *line_ = nullptr;
    uint64_t frames_ = 0;
    unsigned row_ = 0, clock_ = 0;  // row in the frame; clock in the row
    unsigned rows_to_wait_ = 0;     // remaining rows of the exposure after a restart
    unsigned row_clocks_ = 0, lead_clocks_ = 0, frame_rows_ = 0;
};

}  // namespace simrig

#endif
