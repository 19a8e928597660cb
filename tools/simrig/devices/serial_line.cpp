// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/devices/serial_line.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace simrig {

namespace {
constexpr size_t kLongestLine = 64;
}  // namespace

SerialLine::SerialLine(double bits_per_s, double answer_ms, Answer answer, uint64_t seed)
    : byte_us_(1e7 / bits_per_s),
      answer_us_(answer_ms * 1000),
      answer_(std::move(answer)),
      noise_(seed) {}

void SerialLine::send(double time_us, const std::vector<uint8_t> &bytes) {
    for (const uint8_t value : bytes) {
        line_free_us_ = std::max(line_free_us_, time_us) + byte_us_;
        if (!noise_.chance(faults.lost_chance)) {
            to_device_.push_back({line_free_us_, value});
        }
    }
}

void SerialLine::answer(double time_us, const std::string &text) {
    if (faults.silent || text.empty()) {
        return;
    }
    host_free_us_ = std::max(host_free_us_, time_us + answer_us_ + faults.late_ms * 1000);
    const size_t pause = faults.split_ms > 0 ? 1 + noise_.next() % text.size() : text.size();
    for (size_t i = 0; i < text.size(); i++) {
        host_free_us_ += byte_us_ + (i == pause ? faults.split_ms * 1000 : 0);
        if (noise_.chance(faults.lost_chance)) {
            continue;
        }
        const bool garbage = noise_.chance(faults.garbage_chance);
        to_host_.push_back({host_free_us_, garbage ? uint8_t(noise_.next()) : uint8_t(text[i])});
    }
}

void SerialLine::advance(double time_us) {
    while (!to_device_.empty() && to_device_.front().time_us <= time_us) {
        const Byte byte = to_device_.front();
        to_device_.pop_front();
        if (byte.value == '\n') {
            const std::string line = std::exchange(line_, std::string());
            answer(byte.time_us, answer_(byte.time_us, line));
        } else if (line_.size() < kLongestLine) {
            line_ += char(byte.value);
        }
    }
}

std::vector<uint8_t> SerialLine::take(double time_us) {
    advance(time_us);
    std::vector<uint8_t> bytes;
    while (!to_host_.empty() && to_host_.front().time_us <= time_us) {
        bytes.push_back(to_host_.front().value);
        to_host_.pop_front();
    }
    return bytes;
}

double SerialLine::next_us() const {
    if (!to_host_.empty()) {
        return to_host_.front().time_us;
    }
    // What the device has not got yet may make it answer.
    return to_device_.empty() ? std::numeric_limits<double>::infinity() : to_device_.back().time_us;
}

}  // namespace simrig
