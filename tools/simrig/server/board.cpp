// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/board.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace simrig {

namespace {

// A day: what is asked for beyond is a mistake.
constexpr double kLongestUs = 86400e6;
constexpr unsigned kMostColumns = 2112, kMostRows = 1568;

BodyWriter ok() {
    BodyWriter reply;
    reply.u32(SIMRIG_OK);
    return reply;
}

simrig_status status_of(I2cStatus status) {
    switch (status) {
        case I2cStatus::kOk:
            return SIMRIG_OK;
        case I2cStatus::kNackAddress:
            return SIMRIG_I2C_NACK_ADDRESS;
        case I2cStatus::kNackData:
            return SIMRIG_I2C_NACK_DATA;
        case I2cStatus::kArbitration:
            return SIMRIG_I2C_ARBITRATION;
        case I2cStatus::kTimeout:
            return SIMRIG_I2C_TIMEOUT;
        case I2cStatus::kStuck:
            return SIMRIG_I2C_STUCK;
    }
    return SIMRIG_FAILED;
}

uint64_t whole_us(double time_us) {
    return uint64_t(time_us);
}

}  // namespace

Body refusal(simrig_status status, const std::string &text) {
    BodyWriter reply;
    reply.u32(uint32_t(int32_t(status)));
    reply.text(text);
    return reply.take();
}

Board::Board(Rig &rig, std::string rig_name, bool wall_time, Control control)
    : rig_(rig),
      rig_name_(std::move(rig_name)),
      wall_time_(wall_time),
      control_(std::move(control)) {}

Body Board::greet(const Body &body, bool board_is_taken, std::optional<simrig_role> &role) {
    role.reset();
    try {
        BodyReader reader(body);
        const uint32_t magic = reader.u32();
        const uint16_t version = reader.u16(), asked = reader.u16();
        if (magic != SIMRIG_MAGIC) {
            return refusal(SIMRIG_BAD_REQUEST, "this is not a greeting of the simrig protocol");
        }
        if (version != SIMRIG_VERSION) {
            return refusal(SIMRIG_BAD_VERSION, "the client speaks version " +
                                                   std::to_string(version) +
                                                   " of the protocol, this simrig version " +
                                                   std::to_string(SIMRIG_VERSION));
        }
        if (asked > SIMRIG_ROLE_CONTROL) {
            return refusal(SIMRIG_BAD_REQUEST, "there is no role " + std::to_string(asked));
        }
        if (asked == SIMRIG_ROLE_BOARD && board_is_taken) {
            return refusal(SIMRIG_BUSY, "another client is the board; it has to disconnect first");
        }
        role = simrig_role(asked);
    } catch (const BodyTooShort &) {
        return refusal(SIMRIG_BAD_REQUEST, "the greeting is too short");
    }
    BodyWriter reply = ok();
    reply.u16(SIMRIG_VERSION);
    reply.u16(wall_time_ ? 1 : 0);
    reply.text(rig_name_);
    return reply.take();
}

std::optional<Body> Board::begin(uint16_t type, const Body &body, simrig_role role) {
    try {
        return begin_checked(type, BodyReader(body), role);
    } catch (const BodyTooShort &) {
        return refusal(SIMRIG_BAD_REQUEST,
                       "the body of request " + std::to_string(type) + " is too short");
    }
}

std::optional<Body> Board::begin_checked(uint16_t type, BodyReader body, simrig_role role) {
    switch (type) {
        case SIMRIG_TIME: {
            BodyWriter reply = ok();
            reply.u64(whole_us(rig_.now_us()));
            return reply.take();
        }
        case SIMRIG_ADVANCE: {
            const auto until_us = double(body.u64());
            const uint32_t wake = body.u32();
            if (until_us > rig_.now_us() + kLongestUs) {
                return refusal(SIMRIG_BAD_REQUEST, "more than a day is asked for at once");
            }
            pending_ = Pending{type, until_us, wake};
            return std::nullopt;
        }
        case SIMRIG_CONTROL:
            try {
                BodyWriter reply = ok();
                reply.text(control_(body.rest()));
                return reply.take();
            } catch (const std::runtime_error &error) {
                return refusal(SIMRIG_FAILED, error.what());
            }
        default:
            break;
    }
    if (type < SIMRIG_I2C || type > SIMRIG_SERIAL_READ) {
        return refusal(SIMRIG_BAD_REQUEST, "there is no request " + std::to_string(type));
    }
    if (role != SIMRIG_ROLE_BOARD) {
        return refusal(SIMRIG_NOT_ALLOWED, "only the board may do this");
    }
    return begin_board(type, body);
}

std::optional<Body> Board::begin_board(uint16_t type, BodyReader body) {
    BodyWriter reply = ok();
    switch (type) {
        case SIMRIG_I2C:
            return i2c(body);
        case SIMRIG_GPIO_SET:
            rig_.set_bridge_reset((body.u32() & SIMRIG_OUT_BRIDGE_RESET) != 0);
            return reply.take();
        case SIMRIG_GPIO_GET:
            return gpio_get();
        case SIMRIG_FRAME_ARM: {
            const uint16_t columns = body.u16(), rows = body.u16();
            if (columns == 0 || rows == 0 || columns > kMostColumns || rows > kMostRows) {
                return refusal(SIMRIG_BAD_REQUEST,
                               "a frame has 1 to 2112 columns and 1 to 1568 rows");
            }
            rig_.arm_frame(columns, rows);
            return reply.take();
        }
        case SIMRIG_FRAME_WAIT: {
            const auto deadline_us = double(body.u64());
            if (!rig_.frame_armed()) {
                return refusal(SIMRIG_NO_FRAME_ARMED, "no frame is armed");
            }
            pending_ = Pending{type, std::min(deadline_us, rig_.now_us() + kLongestUs), 0};
            return std::nullopt;
        }
        case SIMRIG_FRAME_CANCEL:
            rig_.cancel_frame();
            return reply.take();
        case SIMRIG_SERIAL_WRITE: {
            if (body.left() > SIMRIG_SERIAL_BYTES_MAX) {
                return refusal(SIMRIG_BAD_REQUEST, "too many bytes for the serial line at once");
            }
            rig_.serial().send(rig_.now_us(), body.bytes(body.left()));
            return reply.take();
        }
        default:
            reply.bytes(rig_.serial().take(rig_.now_us()));
            return reply.take();
    }
}

Body Board::i2c(BodyReader body) {
    const uint32_t speed_hz = body.u32();
    const uint16_t count = body.u16();
    if (count == 0 || count > SIMRIG_I2C_MESSAGES_MAX) {
        return refusal(SIMRIG_BAD_REQUEST, "a transfer has 1 to 42 messages");
    }
    if (speed_hz < 10000 || speed_hz > 1000000) {
        return refusal(SIMRIG_BAD_REQUEST, "the bus runs at 10 kHz to 1 MHz");
    }
    std::vector<I2cMessage> messages(count);
    for (I2cMessage &message : messages) {
        message.address = body.u8();
        message.read = (body.u8() & SIMRIG_I2C_READ) != 0;
        const uint16_t length = body.u16();
        if (message.address > 0x7F || length > SIMRIG_I2C_BYTES_MAX ||
            (message.read && length == 0)) {
            return refusal(
                SIMRIG_BAD_REQUEST,
                "an address has 7 bits, a message 8192 bytes at most, a read 1 at least");
        }
        message.bytes = message.read ? std::vector<uint8_t>(length) : body.bytes(length);
    }
    const I2cResult result = rig_.i2c(speed_hz, messages);
    BodyWriter reply;
    reply.u32(uint32_t(int32_t(status_of(result.status))));
    reply.u16(uint16_t(result.messages_done));
    reply.u16(uint16_t(result.bytes_done));
    for (const I2cMessage &message : messages) {
        if (message.read) {
            reply.bytes(message.bytes);
        }
    }
    return reply.take();
}

Body Board::gpio_get() {
    const std::vector<GpioEdge> edges = rig_.take_irq_edges();
    BodyWriter reply = ok();
    reply.u32(rig_.irq() ? SIMRIG_IN_IRQ : 0);
    reply.u32(uint32_t(edges.size()));
    for (const GpioEdge &edge : edges) {
        reply.u64(whole_us(edge.time_us));
        reply.u8(0);
        reply.u8(edge.level ? 1 : 0);
    }
    return reply.take();
}

Body Board::frame(double deadline_us) {
    if (!rig_.wait_frame(deadline_us)) {
        return refusal(SIMRIG_DEADLINE, "no frame came until the deadline");
    }
    const PpiFrame frame = rig_.take_frame();
    BodyWriter reply = ok();
    reply.u64(frame.begin_ps / kPsPerUs);
    reply.u64(frame.end_ps / kPsPerUs);
    reply.u32(frame.number);
    reply.u16(uint16_t(frame.columns));
    reply.u16(uint16_t(frame.rows));
    uint32_t faults = 0;
    faults |= frame.short_line ? uint32_t(SIMRIG_FRAME_SHORT_LINE) : 0u;
    faults |= frame.short_frame ? uint32_t(SIMRIG_FRAME_SHORT) : 0u;
    faults |= frame.long_frame ? uint32_t(SIMRIG_FRAME_LONG) : 0u;
    reply.u32(faults);
    for (const uint16_t pixel : frame.pixels) {
        reply.u16(pixel);
    }
    return reply.take();
}

std::optional<Body> Board::step(double slice_us) {
    const Pending pending = *pending_;
    const double end_us = std::min(pending.until_us, rig_.now_us() + slice_us);
    if (pending.type == SIMRIG_FRAME_WAIT) {
        if (!rig_.wait_frame(end_us) && end_us < pending.until_us) {
            return std::nullopt;
        }
        pending_.reset();
        return frame(rig_.now_us());
    }
    const uint32_t woken = rig_.advance(end_us, pending.wake);
    if (woken == 0 && end_us < pending.until_us) {
        return std::nullopt;
    }
    pending_.reset();
    BodyWriter reply = ok();
    reply.u64(whole_us(rig_.now_us()));
    reply.u32(woken);
    return reply.take();
}

void Board::release() {
    rig_.release_board();
}

}  // namespace simrig
