// SPDX-License-Identifier: Apache-2.0
/// An RS-232 line to a device: bytes with times, and the faults that lines have. Times are whole
/// picoseconds, so that "when is the next byte" and "it is there" agree for ever.
#ifndef VERGENCE_SIMRIG_DEVICES_SERIAL_LINE_HPP
#define VERGENCE_SIMRIG_DEVICES_SERIAL_LINE_HPP

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/devices/noise.hpp"

namespace simrig {

/// Numbers of a line; every imperfection can be 0. Also what a test sets at a given time.
struct SerialFaults {
    bool silent = false;        ///< nothing comes back
    double late_ms = 0;         ///< each answer comes so much later
    double split_ms = 0;        ///< a pause somewhere in each answer
    double garbage_chance = 0;  ///< of each byte that comes back to be another
    double lost_chance = 0;     ///< of each byte in either direction to be lost
};

class SerialLine {
  public:
    /// bits_per_s: a byte takes ten bits. answer: gets a line (without its end) when it has
    /// arrived, and gives the bytes that come back.
    using Answer = std::function<std::string(double time_us, const std::string &line)>;
    SerialLine(double bits_per_s, double answer_ms, Answer answer, uint64_t seed);

    /// Bytes that the host sends from time_ps on.
    void send(uint64_t time_ps, const std::vector<uint8_t> &bytes);
    /// The bytes that have come to the host until then.
    std::vector<uint8_t> take(uint64_t time_ps);
    /// When the next byte comes to the host; kNever: none on its way.
    uint64_t next_ps() const;
    static constexpr uint64_t kNever = UINT64_MAX;
    /// Lets the device do what is due until then.
    void advance(uint64_t time_ps);

    SerialFaults faults;

  private:
    struct Byte {
        uint64_t time_ps;
        uint8_t value;
    };
    void answer(uint64_t time_ps, const std::string &text);

    uint64_t byte_ps_, answer_ps_;
    Answer answer_;
    Noise noise_;
    std::deque<Byte> to_device_, to_host_;
    std::string line_;
    uint64_t line_free_ps_ = 0, host_free_ps_ = 0;
};

}  // namespace simrig

#endif
