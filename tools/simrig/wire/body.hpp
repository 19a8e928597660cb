// SPDX-License-Identifier: Apache-2.0
/// Reads and writes the bytes of a message's body: little endian, never past the end.
#ifndef VERGENCE_SIMRIG_WIRE_BODY_HPP
#define VERGENCE_SIMRIG_WIRE_BODY_HPP

#include <cstdint>
#include <string>
#include <vector>

namespace simrig {

/// Thrown by BodyReader: the body is shorter than its type requires.
struct BodyTooShort {};

class BodyReader {
  public:
    BodyReader(const uint8_t *data, size_t size) : data_(data), size_(size) {}
    explicit BodyReader(const std::vector<uint8_t> &body) : BodyReader(body.data(), body.size()) {}

    uint8_t u8() { return uint8_t(number(1)); }
    uint16_t u16() { return uint16_t(number(2)); }
    uint32_t u32() { return uint32_t(number(4)); }
    uint64_t u64() { return number(8); }
    std::vector<uint8_t> bytes(size_t count) {
        const uint8_t *from = take(count);
        return std::vector<uint8_t>(from, from + count);
    }
    std::string rest() {
        const size_t count = size_ - at_;
        const uint8_t *from = take(count);
        return std::string(from, from + count);
    }
    size_t left() const { return size_ - at_; }

  private:
    const uint8_t *take(size_t count) {
        if (count > size_ - at_) {
            throw BodyTooShort();
        }
        at_ += count;
        return data_ + (at_ - count);
    }
    uint64_t number(size_t count) {
        const uint8_t *from = take(count);
        uint64_t value = 0;
        for (size_t i = 0; i < count; i++) {
            value |= uint64_t(from[i]) << (8 * i);
        }
        return value;
    }

    const uint8_t *data_;
    size_t size_, at_ = 0;
};

class BodyWriter {
  public:
    void u8(uint8_t value) { number(value, 1); }
    void u16(uint16_t value) { number(value, 2); }
    void u32(uint32_t value) { number(value, 4); }
    void u64(uint64_t value) { number(value, 8); }
    void bytes(const std::vector<uint8_t> &values) {
        body_.insert(body_.end(), values.begin(), values.end());
    }
    void text(const std::string &value) { body_.insert(body_.end(), value.begin(), value.end()); }
    std::vector<uint8_t> take() { return std::move(body_); }

  private:
    void number(uint64_t value, size_t count) {
        for (size_t i = 0; i < count; i++) {
            body_.push_back(uint8_t(value >> (8 * i)));
        }
    }

    std::vector<uint8_t> body_;
};

}  // namespace simrig

#endif
