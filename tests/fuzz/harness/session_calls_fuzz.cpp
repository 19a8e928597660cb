// SPDX-License-Identifier: Apache-2.0
// Damaged calls of a recorded session: they are refused in one line, or each call is answered; the
// clock never hangs, and a call that was not recorded ends the replay with a reason.
//
// The input is the whole file (first byte 0), or per line a byte for a call and then its answer,
// from which a log with valid checks is made.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

#include "core/crc.h"
#include "core/error.h"
#include "daemon/backends/replay/replay.h"
#include "fuzz_check.hpp"
#include "memory_folder.hpp"

namespace {

constexpr std::uint64_t kDeadlineUs = 1000;
constexpr hal_camera_format kFormat = {64, 48};
std::uint8_t out[3] = {0, 1, 2}, in[4];
hal_i2c_message transfer[] = {{out, sizeof out, 0x2C, false}, {in, sizeof in, 0x2C, true}};

// A call of the instrument: how it is logged, and the call.
struct Call {
    std::string reported;
    void (*made)(const rig_ports &ports);
};

std::string print(const char *format, ...) __attribute__((format(printf, 1, 2)));
std::string print(const char *format, ...) {
    char text[TRACE_LINE_MAX + 1];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

std::string print_transfer() {
    char messages[TRACE_LINE_MAX + 1];
    trace_i2c(messages, transfer, 2);
    return print(TRACE_I2C_TRANSFER, kDeadlineUs, messages);
}

void take_frame(const rig_ports &ports) {
    const hal_camera *camera = ports.camera[0];
    hal_camera_frame frame{};
    if (camera->operations->take(camera->self, 0, kDeadlineUs, &frame) == 0) {
        FUZZ_CHECK(frame.image.data != nullptr);
        raw_image_release(&frame.image);
    }
}

void read_line(const rig_ports &ports) {
    const hal_uart *uart = ports.lens_uart;
    std::size_t bytes = 0;
    if (uart->operations->read(uart->self, in, sizeof in, kDeadlineUs, &bytes) == 0) {
        FUZZ_CHECK(bytes >= 1 && bytes <= sizeof in);
    }
}

const Call calls[] = {
    {print(TRACE_CLOCK_WAIT, kDeadlineUs),
     [](const rig_ports &p) { p.clock->operations->wait_until_us(p.clock->self, kDeadlineUs); }},
    {print_transfer(),
     [](const rig_ports &p) {
         std::size_t begun = 0;
         FUZZ_CHECK(p.i2c->operations->transfer(p.i2c->self, transfer, 2, kDeadlineUs, &begun) <=
                    0);
     }},
    {print(TRACE_I2C_LINES, 1u),
     [](const rig_ports &p) {
         unsigned high = 0;
         p.i2c->operations->lines(p.i2c->self, 1, &high);
     }},
    {print(TRACE_UART_WRITE, kDeadlineUs, "000102"),
     [](const rig_ports &p) {
         p.lens_uart->operations->write(p.lens_uart->self, out, sizeof out, kDeadlineUs);
     }},
    {print(TRACE_UART_READ, kDeadlineUs, sizeof in), read_line},
    {print(TRACE_UART_DISCARD),
     [](const rig_ports &p) { p.lens_uart->operations->discard(p.lens_uart->self); }},
    {print(TRACE_GPIO_SET, HAL_GPIO_BRIDGE_RESET, true),
     [](const rig_ports &p) {
         p.gpio->operations->set(p.gpio->self, HAL_GPIO_BRIDGE_RESET, true);
     }},
    {print(TRACE_GPIO_GET, HAL_GPIO_BRIDGE_IRQ),
     [](const rig_ports &p) {
         bool active = false;
         p.gpio->operations->get(p.gpio->self, HAL_GPIO_BRIDGE_IRQ, &active);
     }},
    {print(TRACE_CAMERA_START, 0, kFormat.width_px, kFormat.height_px),
     [](const rig_ports &p) { p.camera[0]->operations->start(p.camera[0]->self, &kFormat); }},
    {print(TRACE_CAMERA_TAKE, 0, std::uint64_t{0}, kDeadlineUs), take_frame},
    {print(TRACE_CAMERA_CONTROL, 0, HAL_CAMERA_EXPOSURE_US, 5),
     [](const rig_ports &p) {
         std::int32_t applied = 0;
         p.camera[0]->operations->control(p.camera[0]->self, HAL_CAMERA_EXPOSURE_US, 5, &applied);
     }},
    {print(TRACE_CAMERA_COUNTS, 0),
     [](const rig_ports &p) {
         hal_camera_counts counts;
         p.camera[0]->operations->counts(p.camera[0]->self, &counts);
     }},
    {print(TRACE_CAMERA_STOP, 0),
     [](const rig_ports &p) { p.camera[0]->operations->stop(p.camera[0]->self); }},
};

// The log of those calls, and which they are.
std::string made(const std::string &text, std::vector<const Call *> *making) {
    std::string log =
        TRACE_FIRST_LINE "\nports i2c=1 lines=1 gpio=1 uart=1 cameras=1 controls=10\n";
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        making->push_back(&calls[std::uint8_t(text[at]) % std::size(calls)]);
        log += std::to_string(making->size()) + " " + making->back()->reported + TRACE_EQUALS +
               text.substr(at + 1, end - std::min(end, at + 1)) + "\n";
        at = end + 1;
    }
    char check[sizeof TRACE_CHECK + SESSION_CRC_DIGITS + 1];
    std::snprintf(check, sizeof check, TRACE_CHECK "%08x\n",
                  unsigned(crc_update(0, log.data(), log.size())));
    return log + check;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    static const MemoryFolder folder;
    static const bool begun = [] {
        std::string line = "begin version=5 build=x profile=rig date=x";
        char crc[16];
        std::snprintf(crc, sizeof crc, " %08x\n",
                      unsigned(crc_update(0, line.data(), line.size())));
        folder.write(SESSION_INDEX_NAME, line + crc);
        return true;
    }();
    static replay play;
    static message message_out;
    FUZZ_CHECK(begun);
    const std::string text(reinterpret_cast<const char *>(data), size);
    const bool raw = size > 0 && data[0] == 0;
    std::vector<const Call *> making;
    folder.write(SESSION_CALLS_NAME, raw ? text.substr(1) : made(text, &making));
    const int error = replay_open(&play, AT_FDCWD, folder.path().c_str(), nullptr, &message_out);
    if (error != 0) {
        FUZZ_CHECK(error == ERROR_CRC || error == ERROR_SYNTAX || error == ERROR_MISSING);
        FUZZ_CHECK(message_out.text[0] != '\0' && std::strchr(message_out.text, '\n') == nullptr);
        return 0;
    }
    if (!raw) {
        for (const Call *const call : making) {
            call->made(play.ports);
        }
        FUZZ_CHECK(play.ended || replay_is_over(&play));
    }
    // Behind the end, or where something else was recorded.
    const hal_clock *clock = play.ports.clock;
    const std::uint64_t before_us = clock->operations->now_us(clock->self);
    clock->operations->wait_until_us(clock->self, before_us + 1);
    if (play.ended) {
        FUZZ_CHECK(play.last_error.text[0] != '\0');
        FUZZ_CHECK(clock->operations->now_us(clock->self) > before_us ||
                   before_us > ~0ull - 2000000);
    }
    replay_close(&play);
    return 0;
}
