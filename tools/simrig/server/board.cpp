// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/board.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "tools/simrig/render/picture.hpp"
#include "tools/simrig/wire/body.hpp"

namespace simrig {

namespace {

// A day: more is a client's mistake.
constexpr double kLongestUs = 86400e6;
// Rig time between two polls of the clients; a replay uses the same slices.
constexpr double kSliceUs = 5000;
// Bytes of a truth reply before its layers.
constexpr int kTruthHeadBytes = 8;

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

uint32_t bits_of(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

void put(BodyWriter &reply, const std::vector<float> &values) {
    for (const float value : values) {
        reply.u32(bits_of(value));
    }
}

}  // namespace

Board::Board(Rig &rig, ControlServer &control_connection, WallClock clock)
    : rig_(rig), control_server_(control_connection), clock_(std::move(clock)) {}

std::optional<Body> Board::begin(uint16_t type, const Body &body, simrig_role role) {
    try {
        const Request request = decode(type, body);
        if (role != SIMRIG_ROLE_BOARD && is_for_board(request)) {
            throw Refused{SIMRIG_NOT_ALLOWED, "only the board may do this"};
        }
        return std::visit([this](const auto &asked) { return answer(asked); }, request);
    } catch (const Refused &why) {
        return rejection(why);
    }
}

Board::Answer Board::answer(const Hello &) {
    throw Refused{SIMRIG_BAD_REQUEST, "unexpected second greeting"};
}

Board::Answer Board::answer(const AskTime &) {
    BodyWriter reply = ok();
    reply.u64(whole_us(rig_.now_us()));
    return reply.take();
}

uint32_t Board::there_already(uint32_t wake) {
    uint32_t woken = rig_.has_irq_edges() ? wake & kWakeGpio : 0u;
    woken |= rig_.frame_done() ? wake & kWakeFrame : 0u;
    if ((wake & kWakeSerial) != 0) {
        rig_.serial().advance(rig_.now_ps());
        woken |= rig_.serial().next_ps() <= rig_.now_ps() ? wake & kWakeSerial : 0u;
    }
    return woken;
}

Body Board::time_and(uint32_t woken) const {
    BodyWriter reply = ok();
    reply.u64(whole_us(rig_.now_us()));
    reply.u32(woken);
    return reply.take();
}

Board::Answer Board::answer(const Advance &advance) {
    const auto until_us = double(advance.until_us);
    if (until_us > rig_.now_us() + kLongestUs) {
        throw Refused{SIMRIG_BAD_REQUEST, "ADVANCE by more than a day"};
    }
    const uint32_t woken = there_already(advance.wake);
    if (woken != 0) {
        return time_and(woken);
    }
    pending_ = Pending{false, until_us, advance.wake};
    return std::nullopt;
}

Board::Answer Board::answer(const Transfer &transfer) {
    std::vector<I2cMessage> messages;
    for (const Transfer::Part &part : transfer.parts) {
        messages.push_back(
            {part.address, part.read, part.read ? Body(part.length) : Body(part.bytes)});
    }
    const I2cResult result = rig_.i2c(transfer.speed_hz, messages);
    BodyWriter reply;
    reply.u32(uint32_t(int32_t(status_of(result.status))));
    reply.u16(uint16_t(result.path_costs_done));
    reply.u16(uint16_t(result.bytes_done));
    for (const I2cMessage &message : messages) {
        if (message.read) {
            reply.bytes(message.bytes);
        }
    }
    return reply.take();
}

Board::Answer Board::answer(const GpioSet &set) {
    rig_.set_bridge_reset((set.levels & SIMRIG_OUT_BRIDGE_RESET) != 0);
    return ok().take();
}

Board::Answer Board::answer(const GpioGet &) {
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

Board::Answer Board::answer(const FrameArm &arm) {
    rig_.arm_frame(arm.columns, arm.rows);
    return ok().take();
}

Board::Answer Board::answer(const FrameWait &wait) {
    if (!rig_.frame_armed()) {
        throw Refused{SIMRIG_NO_FRAME_ARMED, "no frame is armed"};
    }
    pending_ =
        Pending{true, std::min(double(wait.deadline_us), rig_.now_us() + kLongestUs), kWakeFrame};
    return std::nullopt;
}

Board::Answer Board::answer(const FrameCancel &) {
    rig_.cancel_frame();
    return ok().take();
}

Board::Answer Board::answer(const SerialWrite &write) {
    rig_.serial().send(rig_.now_ps(), write.bytes);
    return ok().take();
}

Board::Answer Board::answer(const SerialRead &) {
    BodyWriter reply = ok();
    reply.bytes(rig_.serial().take(rig_.now_ps()));
    return reply.take();
}

// An exception of the control side becomes the reply's text.
template <typename Ask>
auto Board::at_control(Ask ask) -> decltype(ask()) {
    try {
        return ask();
    } catch (const std::runtime_error &error) {
        throw Refused{SIMRIG_FAILED, error.what()};
    }
}

Board::Answer Board::answer(const ControlLine &line) {
    BodyWriter reply = ok();
    reply.text(at_control([&] { return control_server_.run(line.text); }));
    return reply.take();
}

Board::Answer Board::answer(const AskTruth &ask) {
    const world::Truth truth = at_control([&] {
        return control_server_.truth_of(ask.camera, 0, control_server_.pictured(ask.camera).rows);
    });
    const std::string camera = world::camera_text(truth);
    BodyWriter reply = ok();
    reply.u16(uint16_t(truth.columns));
    reply.u16(uint16_t(truth.rows));
    reply.u32(uint32_t(camera.size()));
    reply.text(camera);
    put(reply, truth.depth_mm);
    return reply.take();
}

Board::Answer Board::answer(const AskTruthRows &ask) {
    const int columns = at_control([&] { return control_server_.pictured(ask.camera).columns; });
    const bool depth = (ask.layers & SIMRIG_LAYER_DEPTH) != 0;
    const bool normal = (ask.layers & SIMRIG_LAYER_NORMAL) != 0;
    const bool object = (ask.layers & SIMRIG_LAYER_OBJECT) != 0;
    const int pixel_bytes = (depth ? 4 : 0) + (normal ? 12 : 0) + (object ? 1 : 0);
    const int max_rows = (SIMRIG_BODY_MAX - kTruthHeadBytes) / (columns * pixel_bytes);
    if (ask.rows > max_rows) {
        throw Refused{SIMRIG_FAILED,
                      "a reply holds at most " + std::to_string(max_rows) + " such rows"};
    }
    const world::Truth truth =
        at_control([&] { return control_server_.truth_of(ask.camera, ask.first_row, ask.rows); });
    BodyWriter reply = ok();
    reply.u16(uint16_t(truth.columns));
    reply.u16(uint16_t(truth.rows));
    put(reply, depth ? truth.depth_mm : std::vector<float>());
    put(reply, normal ? truth.normal : std::vector<float>());
    reply.bytes(object ? truth.id : std::vector<uint8_t>());
    return reply.take();
}

Body Board::frame() {
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

double Board::slice_end(double until_us) const {
    const double end_us = std::min(until_us, rig_.now_us() + kSliceUs);
    return clock_ ? std::min(end_us, std::max(clock_(), rig_.now_us())) : end_us;
}

std::optional<Body> Board::step() {
    const Pending pending = *pending_;
    const double end_us = slice_end(pending.until_us);
    if (pending.for_frame) {
        const bool done = rig_.wait_frame(end_us);
        if (!done && end_us < pending.until_us) {
            return std::nullopt;
        }
        pending_.reset();
        return done ? frame() : rejection({SIMRIG_DEADLINE, "no frame came until the deadline"});
    }
    const uint32_t woken = rig_.advance(end_us, pending.wake);
    if (woken == 0 && end_us < pending.until_us) {
        return std::nullopt;
    }
    pending_.reset();
    return time_and(woken);
}

bool Board::keep_up() {
    const double clock_us = clock_();
    if (clock_us > rig_.now_us()) {
        rig_.advance(slice_end(clock_us), 0);
    }
    return clock_us > rig_.now_us() + kSliceUs;
}

void Board::release() {
    rig_.release_board();
}

}  // namespace simrig
