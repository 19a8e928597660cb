// SPDX-License-Identifier: Apache-2.0
/// Bytes of records and messages of recordings: little-endian numbers. Messages of ROS 2 (CDR,
/// XCDR1) align each number to its size, counted from behind their four bytes of encapsulation;
/// records and messages of ROS 1 do not. Sources: https://mcap.dev/spec; OMG DDS-XTypes 1.3,
/// section 7.4.1.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_LITTLE_ENDIAN_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_LITTLE_ENDIAN_HPP

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

/// Thrown by `byte_reader`.
struct bytes_ended : std::runtime_error {
    bytes_ended() : std::runtime_error("ends too early") {}
};

/// The bytes of a number between the machine's order and little-endian: either way.
inline void swap_to_little(unsigned char *raw, size_t size) {
    const uint16_t one = 1;
    unsigned char first;
    std::memcpy(&first, &one, 1);
    for (size_t i = 0; first != 1 && i < size / 2; i++) {
        std::swap(raw[i], raw[size - 1 - i]);
    }
}

class byte_writer {
  public:
    template <class Number>
    void number(Number value) {
        align(sizeof value);
        unsigned char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        swap_to_little(raw, sizeof value);
        bytes.append(reinterpret_cast<const char *>(raw), sizeof value);
    }

    void u8(unsigned value) { number(static_cast<uint8_t>(value)); }
    void u16(unsigned value) { number(static_cast<uint16_t>(value)); }
    void u32(size_t value) { number(static_cast<uint32_t>(value)); }
    void u64(uint64_t value) { number(value); }
    void f64(double value) { number(value); }
    void f32(float value) { number(value); }

    void numbers(const double *values, size_t count) {
        for (size_t i = 0; i < count; i++) {
            f64(values[i]);
        }
    }

    /// A length and bytes.
    void sized(const std::string &data) {
        u32(data.size());
        bytes += data;
    }

    std::string bytes;

  protected:
    virtual void align(size_t) {}
    ~byte_writer() = default;
};

class record_writer final : public byte_writer {};

class cdr_writer final : public byte_writer {
  public:
    cdr_writer() { bytes.assign("\0\1\0\0", 4); }

    /// A text with its zero.
    void text(const std::string &value) { sized(value + '\0'); }

  protected:
    void align(size_t size) override {
        bytes.append((size - (bytes.size() - 4) % size) % size, '\0');
    }
};

class byte_reader {
  public:
    /// `cdr`: numbers are aligned, and texts have a zero. The data must outlive this.
    byte_reader(const char *data, size_t length, bool cdr = false)
        : data_(data), length_(length), cdr_(cdr) {
        if (cdr) {
            if (length < 4 || data[0] != 0 || data[1] != 1) {
                throw std::runtime_error("is not little-endian CDR");
            }
            at_ = 4;
        }
    }

    template <class Number>
    Number number() {
        Number value;
        if (cdr_) {
            skip((sizeof value - (at_ - 4) % sizeof value) % sizeof value);
        }
        unsigned char raw[sizeof value];
        std::memcpy(raw, take(sizeof value), sizeof value);
        swap_to_little(raw, sizeof value);
        std::memcpy(&value, raw, sizeof value);
        return value;
    }

    uint8_t u8() { return number<uint8_t>(); }
    uint16_t u16() { return number<uint16_t>(); }
    uint32_t u32() { return number<uint32_t>(); }
    uint64_t u64() { return number<uint64_t>(); }
    double f64() { return number<double>(); }

    /// Bytes that a length precedes; of a message's text without its zero.
    std::string text() {
        const size_t count = u32();
        std::string value(take(count), count);
        if (cdr_ && !value.empty() && value.back() == '\0') {
            value.pop_back();
        }
        return value;
    }

    const char *take(size_t count) {
        if (count > length_ - at_) {
            throw bytes_ended();
        }
        at_ += count;
        return data_ + at_ - count;
    }
    void skip(size_t count) { take(count); }
    size_t left() const { return length_ - at_; }
    bool cdr() const { return cdr_; }

  private:
    const char *data_;
    size_t length_, at_ = 0;
    bool cdr_;
};

#endif
