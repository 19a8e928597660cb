// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/wire/request.hpp"

#include "tools/simrig/wire/body.hpp"

namespace simrig {

namespace {

// The sensor's physical array.
constexpr unsigned kMaxColumns = 2112, kMaxRows = 1568;
constexpr unsigned kAllLayers = SIMRIG_LAYER_DEPTH | SIMRIG_LAYER_NORMAL | SIMRIG_LAYER_OBJECT;
constexpr unsigned kSlowestHz = 10000, kFastestHz = 1000000;
// Bits of a byte with its acknowledgement.
constexpr uint64_t kByteBits = 9;

[[noreturn]] void bad(const std::string &text) {
    throw Refused{SIMRIG_BAD_REQUEST, text};
}

Hello read_hello(BodyReader &body) {
    if (body.left() < 8) {
        bad("greeting too short");
    }
    if (body.u32() != SIMRIG_MAGIC) {
        bad("not a greeting of the simrig protocol");
    }
    const uint16_t version = body.u16(), role = body.u16();
    if (version != SIMRIG_VERSION) {
        throw Refused{SIMRIG_BAD_VERSION, "unknown protocol version " + std::to_string(version) +
                                              " (expected " + std::to_string(SIMRIG_VERSION) + ")"};
    }
    if (role > SIMRIG_ROLE_CONTROL) {
        bad("unknown role " + std::to_string(role) + " (expected 0 or 1)");
    }
    if (body.left() > SIMRIG_NAME_MAX) {
        bad("client name longer than 64 bytes");
    }
    return {simrig_role(role), body.rest()};
}

Transfer::Part read_part(BodyReader &body) {
    Transfer::Part part;
    part.address = body.u8();
    const uint8_t flags = body.u8();
    part.read = (flags & SIMRIG_I2C_READ) != 0;
    part.length = body.u16();
    if (part.address > 0x7F || flags > SIMRIG_I2C_READ) {
        bad("an address must have 7 bits and flags of 0 or 1");
    }
    if (part.length > SIMRIG_I2C_BYTES_MAX || (part.read && part.length == 0)) {
        bad("a message must have at most 8192 bytes, a read at least 1");
    }
    if (!part.read) {
        part.bytes = body.bytes(part.length);
    }
    return part;
}

Transfer read_transfer(BodyReader &body) {
    Transfer transfer;
    transfer.speed_hz = body.u32();
    const uint16_t count = body.u16();
    if (transfer.speed_hz < kSlowestHz || transfer.speed_hz > kFastestHz) {
        bad("bus speed must be 10 kHz to 1 MHz");
    }
    if (count == 0 || count > SIMRIG_I2C_MESSAGES_MAX) {
        bad("a transfer must have 1 to 42 messages");
    }
    uint64_t bits = 0;
    for (unsigned i = 0; i < count; i++) {
        transfer.parts.push_back(read_part(body));
        bits += kByteBits * (transfer.parts.back().length + 1u);
    }
    if (bits > transfer.speed_hz) {
        bad("a transfer must take at most a second");
    }
    return transfer;
}

Advance read_advance(BodyReader &body) {
    const uint64_t until_us = body.u64();
    const uint32_t wake = body.u32();
    if (wake > (SIMRIG_WAKE_GPIO | SIMRIG_WAKE_SERIAL | SIMRIG_WAKE_FRAME)) {
        bad("unknown wake bits " + std::to_string(wake));
    }
    return {until_us, wake};
}

FrameArm read_frame_arm(BodyReader &body) {
    const uint16_t columns = body.u16(), rows = body.u16();
    if (columns == 0 || rows == 0 || columns > kMaxColumns || rows > kMaxRows) {
        bad("a frame must have 1 to 2112 columns and 1 to 1568 rows");
    }
    return {columns, rows};
}

GpioSet read_gpio_set(BodyReader &body) {
    const uint32_t levels = body.u32();
    if (levels > SIMRIG_OUT_BRIDGE_RESET) {
        bad("unknown line");
    }
    return {levels};
}

uint8_t read_camera(BodyReader &body) {
    const uint8_t camera = body.u8();
    if (camera > 1) {
        bad("unknown camera " + std::to_string(camera) + " (expected 0, left, or 1, right)");
    }
    return camera;
}

AskTruthRows read_truth_rows(BodyReader &body) {
    const uint8_t camera = read_camera(body), layers = body.u8();
    const uint16_t first_row = body.u16(), rows = body.u16();
    if (layers == 0 || layers > kAllLayers) {
        bad("unknown layers " + std::to_string(layers) + " (expected a sum of 1, 2 and 4)");
    }
    if (rows == 0 || first_row + rows > int(kMaxRows)) {
        bad("rows must be 1 to 1568");
    }
    return {camera, layers, first_row, rows};
}

Request decode_body(uint16_t type, BodyReader &body) {
    switch (type) {
        case SIMRIG_HELLO:
            return read_hello(body);
        case SIMRIG_TIME:
            return AskTime{};
        case SIMRIG_ADVANCE:
            return read_advance(body);
        case SIMRIG_I2C:
            return read_transfer(body);
        case SIMRIG_GPIO_SET:
            return read_gpio_set(body);
        case SIMRIG_GPIO_GET:
            return GpioGet{};
        case SIMRIG_FRAME_ARM:
            return read_frame_arm(body);
        case SIMRIG_FRAME_WAIT:
            return FrameWait{body.u64()};
        case SIMRIG_FRAME_CANCEL:
            return FrameCancel{};
        case SIMRIG_SERIAL_WRITE:
            if (body.left() > SIMRIG_SERIAL_BYTES_MAX) {
                bad("more than 4096 bytes to the serial line");
            }
            return SerialWrite{body.bytes(body.left())};
        case SIMRIG_SERIAL_READ:
            return SerialRead{};
        case SIMRIG_CONTROL:
            if (body.left() > SIMRIG_CONTROL_BYTES_MAX) {
                bad("command longer than 4096 bytes");
            }
            return ControlLine{body.rest()};
        case SIMRIG_TRUTH:
            return AskTruth{read_camera(body)};
        case SIMRIG_TRUTH_ROWS:
            return read_truth_rows(body);
        default:
            bad("unknown request " + std::to_string(type));
    }
}

}  // namespace

bool is_for_board(const Request &request) {
    return !std::holds_alternative<AskTime>(request) && !std::holds_alternative<Advance>(request) &&
           !std::holds_alternative<ControlLine>(request) &&
           !std::holds_alternative<AskTruth>(request) &&
           !std::holds_alternative<AskTruthRows>(request);
}

Request decode(uint16_t type, const Body &body) {
    BodyReader reader(body);
    try {
        Request request = decode_body(type, reader);
        if (reader.left() > 0) {
            bad("the body of request " + std::to_string(type) + " has " +
                std::to_string(reader.left()) + " bytes too many");
        }
        return request;
    } catch (const BodyTooShort &) {
        bad("the body of request " + std::to_string(type) + " is too short");
    }
}

Body rejection(const Refused &why) {
    BodyWriter reply;
    reply.u32(uint32_t(int32_t(why.status)));
    reply.text(why.text);
    return reply.take();
}

}  // namespace simrig
