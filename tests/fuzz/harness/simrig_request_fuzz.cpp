// SPDX-License-Identifier: Apache-2.0
// Bytes of a client of the simulated rig: they give the same messages in any chunks, and each
// message a request within its limits or a one-line reason.
#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "fuzz_check.hpp"
#include "tools/simrig/wire/request.hpp"

namespace {

using namespace simrig;

struct Limits {
    void operator()(const Hello &hello) const { FUZZ_CHECK(hello.name.size() <= SIMRIG_NAME_MAX); }
    void operator()(const Advance &advance) const { FUZZ_CHECK(advance.wake <= 7); }
    void operator()(const Transfer &transfer) const {
        FUZZ_CHECK(!transfer.parts.empty() && transfer.parts.size() <= SIMRIG_I2C_MESSAGES_MAX);
        FUZZ_CHECK(transfer.speed_hz >= 10000 && transfer.speed_hz <= 1000000);
        std::uint64_t bits = 0;
        for (const Transfer::Part &part : transfer.parts) {
            FUZZ_CHECK(part.address <= 0x7F && part.length <= SIMRIG_I2C_BYTES_MAX);
            FUZZ_CHECK(part.read ? part.length > 0 && part.bytes.empty()
                                 : part.bytes.size() == part.length);
            bits += 9 * (part.length + 1u);
        }
        FUZZ_CHECK(bits <= transfer.speed_hz);
    }
    void operator()(const FrameArm &arm) const {
        FUZZ_CHECK(arm.columns >= 1 && arm.columns <= 2112 && arm.rows >= 1 && arm.rows <= 1568);
    }
    void operator()(const SerialWrite &write) const {
        FUZZ_CHECK(write.bytes.size() <= SIMRIG_SERIAL_BYTES_MAX);
    }
    void operator()(const ControlLine &line) const {
        FUZZ_CHECK(line.text.size() <= SIMRIG_CONTROL_BYTES_MAX);
    }
    void operator()(const AskTruth &ask) const { FUZZ_CHECK(ask.camera <= 1); }
    void operator()(const AskTruthRows &ask) const {
        FUZZ_CHECK(ask.camera <= 1 && ask.layers >= 1 && ask.layers <= 7);
        FUZZ_CHECK(ask.rows >= 1 && ask.first_row + ask.rows <= 1568);
    }
    template <typename Other>
    void operator()(const Other &) const {}
};

void check(const Message &message) {
    try {
        const Request request = decode(message.type, message.body);
        std::visit(Limits(), request);
        // One more byte is refused, except where the body ends in any number of bytes.
        Body longer = message.body;
        longer.push_back(0);
        const bool open_end = std::holds_alternative<Hello>(request) ||
                              std::holds_alternative<SerialWrite>(request) ||
                              std::holds_alternative<ControlLine>(request);
        if (!open_end) {
            try {
                decode(message.type, longer);
                FUZZ_CHECK(false);
            } catch (const Refused &why) {
                FUZZ_CHECK(why.status == SIMRIG_BAD_REQUEST);
            }
        }
    } catch (const Refused &why) {
        FUZZ_CHECK(why.status < 0 && !why.text.empty());
        FUZZ_CHECK(why.text.find('\n') == std::string::npos);
        FUZZ_CHECK(rejection(why).size() == 4 + why.text.size());
    }
}

struct Received {
    std::vector<Message> messages;
    bool too_long = false;
};

// In pieces of `step` bytes.
Received receive(const std::uint8_t *data, std::size_t size, std::size_t step) {
    Inbox inbox;
    Received received;
    for (std::size_t at = 0; at < size && !received.too_long; at += step) {
        inbox.add(data + at, std::min(step, size - at));
        while (const std::optional<Message> message = inbox.next()) {
            received.messages.push_back(*message);
        }
        received.too_long = inbox.too_long().has_value();
    }
    return received;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const Received whole = receive(data, size, size + 1);
    Body again;
    for (const Message &message : whole.messages) {
        check(message);
        append(again, message);
    }
    FUZZ_CHECK(again.size() <= size && std::equal(again.begin(), again.end(), data));
    const Received pieces = receive(data, size, 1 + size % 7);
    FUZZ_CHECK(pieces.too_long == whole.too_long);
    FUZZ_CHECK(pieces.messages.size() == whole.messages.size());
    for (std::size_t i = 0; i < whole.messages.size(); i++) {
        FUZZ_CHECK(pieces.messages[i].type == whole.messages[i].type);
        FUZZ_CHECK(pieces.messages[i].tag == whole.messages[i].tag);
        FUZZ_CHECK(pieces.messages[i].body == whole.messages[i].body);
    }
    return 0;
}
