// SPDX-License-Identifier: Apache-2.0
/// Requests of clients, parsed from a message's bytes and checked as far as possible without a rig.
#ifndef VERGENCE_SIMRIG_WIRE_REQUEST_HPP
#define VERGENCE_SIMRIG_WIRE_REQUEST_HPP

#include <string>
#include <variant>

#include "tools/simrig/wire/message.hpp"

namespace simrig {

/// Why a request is refused: the reply's status and its line.
struct Refused {
    simrig_status status;
    std::string text;
};

struct Hello {
    simrig_role role;
    std::string name;
};
struct AskTime {};
struct Advance {
    uint64_t until_us;
    uint32_t wake;
};
struct Transfer {
    struct Part {
        uint8_t address;
        bool read;
        uint16_t length;
        Body bytes;  ///< data of a write
    };
    uint32_t speed_hz;
    std::vector<Part> parts;
};
struct GpioSet {
    uint32_t levels;
};
struct GpioGet {};
struct FrameArm {
    uint16_t columns, rows;
};
struct FrameWait {
    uint64_t deadline_us;
};
struct FrameCancel {};
struct SerialWrite {
    Body bytes;
};
struct SerialRead {};
struct ControlLine {
    std::string text;
};
struct AskTruth {
    uint8_t camera;
};
struct AskTruthRows {
    uint8_t camera, layers;
    uint16_t first_row, rows;
};

using Request =
    std::variant<Hello, AskTime, Advance, Transfer, GpioSet, GpioGet, FrameArm, FrameWait,
                 FrameCancel, SerialWrite, SerialRead, ControlLine, AskTruth, AskTruthRows>;

/// Whether only the board may send this.
bool is_for_board(const Request &request);

/// Throws Refused: bytes missing or too many, numbers out of range, unknown type.
Request decode(uint16_t type, const Body &body);

/// A reply that reports an error.
Body rejection(const Refused &why);

}  // namespace simrig

#endif
