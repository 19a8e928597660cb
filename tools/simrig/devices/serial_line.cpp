// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/serial_line.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace simrig {

namespace {

constexpr size_t kLongestLine = 64;
constexpr double kPsPerS = 1e12, kPsPerMs = 1e9, kPsPerUs = 1e6;

uint64_t ps_of_ms(double ms) {
    return uint64_t(std::llround(ms * kPsPerMs));
}

}  // namespace

SerialLine::SerialLine(double bits_per_s, double answer_ms, Answer answer, uint64_t seed)
    : byte_ps_(uint64_t(std::llround(10 * kPsPerS / bits_per_s))),
      answer_ps_(ps_of_ms(answer_ms)),
      answer_(std::move(answer)),
      noise_(seed) {}

void SerialLine::send(uint64_t time_ps, const std::vector<uint8_t> &bytes) {
    for (const uint8_t value : bytes) {
        line_free_ps_ = std::max(line_free_ps_, time_ps) + byte_ps_;
        if (!noise_.chance(faults.lost_chance)) {
            to_device_.push_back({line_free_ps_, value});
        }
    }
}

void SerialLine::answer(uint64_t time_ps, const std::string &text) {
    if (faults.silent || text.empty()) {
        return;
    }
    host_free_ps_ = std::max(host_free_ps_, time_ps + answer_ps_ + ps_of_ms(faults.late_ms));
    const size_t pause = faults.split_ms > 0 ? 1 + noise_.next() % text.size() : text.size();
    for (size_t i = 0; i < text.size(); i++) {
        host_free_ps_ += byte_ps_ + (i == pause ? ps_of_ms(faults.split_ms) : 0);
        if (noise_.chance(faults.lost_chance)) {
            continue;
        }
        const bool garbage = noise_.chance(faults.garbage_chance);
        to_host_.push_back({host_free_ps_, garbage ? uint8_t(noise_.next()) : uint8_t(text[i])});
    }
}

void SerialLine::advance(uint64_t time_ps) {
    while (!to_device_.empty() && to_device_.front().time_ps <= time_ps) {
        const Byte byte = to_device_.front();
        to_device_.pop_front();
        if (byte.value == '\n') {
            const std::string line = std::exchange(line_, std::string());
            answer(byte.time_ps, answer_(double(byte.time_ps) / kPsPerUs, line));
        } else if (line_.size() < kLongestLine) {
            line_ += char(byte.value);
        }
    }
}

std::vector<uint8_t> SerialLine::take(uint64_t time_ps) {
    advance(time_ps);
    std::vector<uint8_t> bytes;
    while (!to_host_.empty() && to_host_.front().time_ps <= time_ps) {
        bytes.push_back(to_host_.front().value);
        to_host_.pop_front();
    }
    return bytes;
}

uint64_t SerialLine::next_ps() const {
    if (!to_host_.empty()) {
        return to_host_.front().time_ps;
    }
    // Bytes still on their way to the device may make it answer.
    return to_device_.empty() ? kNever : to_device_.back().time_ps;
}

}  // namespace simrig
