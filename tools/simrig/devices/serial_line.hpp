// SPDX-License-Identifier: Apache-2.0
/// An RS-232 line to a device: bytes with times, and the faults that lines have. Times are whole
/// picoseconds, so that the time of the next byte and its arrival always agree.
#ifndef VERGENCE_SIMRIG_DEVICES_SERIAL_LINE_HPP
#define VERGENCE_SIMRIG_DEVICES_SERIAL_LINE_HPP

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "tools/simrig/devices/noise.hpp"

namespace simrig {

/// Faults of a line; each can be 0. Tests change them at a given time.
struct SerialFaults {
    bool silent = false;        ///< no answers
    double late_ms = 0;         ///< extra delay of each answer
    double split_ms = 0;        ///< a pause somewhere in each answer
    double garbage_chance = 0;  ///< chance of each returned byte to be changed
    double lost_chance = 0;     ///< chance of each byte in either direction to be lost
};

class SerialLine {
  public:
    /// bits_per_s: a byte takes ten bits. answer: maps a received line (without its end) to the
    /// bytes of the answer.
    using Answer = std::function<std::string(double time_us, const std::string &line)>;
    SerialLine(double bits_per_s, double answer_ms, Answer answer, uint64_t seed);

    /// Bytes that the host sends from time_ps on.
    void send(uint64_t time_ps, const std::vector<uint8_t> &bytes);
    /// The bytes that the host has received until then.
    std::vector<uint8_t> take(uint64_t time_ps);
    /// Time when the host receives the next byte; kNever: none pending.
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
