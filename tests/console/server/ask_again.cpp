// SPDX-License-Identifier: Apache-2.0
// usage: ask_again RIG SESSION < CALLS
//
// Repeats recorded calls of the hardware's interfaces (lines as in daemon/session/session.md), in
// order, at a simulated rig that listens at RIG, and records them with their results in the new
// directory SESSION. For frames it requests the one that began when the recorded one did. For
// board_test.py.
#include <fcntl.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/session/record.h"
#include "daemon/session/session_write.h"
// In C a function may have the name of a structure.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#include "daemon/backends/sim/sim_backend.h"
#pragma GCC diagnostic pop

namespace {

const int timeout_ms = 60000;
// The recorded port was always armed. A port armed at the last moment misses a frame, and one armed
// long before gets another: the rig's shortest frames are 886 us apart.
const std::uint64_t lead_us = 800;

[[noreturn]] void give_up(const std::string &why) {
    std::cerr << "ask_again: " << why << "\n";
    std::exit(1);
}

void expect(int code, const std::string &why) {
    if (code != 0) {
        give_up(why);
    }
}

std::vector<std::uint8_t> bytes_of(const std::string &digits) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; digits != "-" && i + 1 < digits.size(); i += 2) {
        bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
    }
    return bytes;
}

/// Start of the frame that a recorded call returned; 0: none.
std::uint64_t begin_of(const std::string &call) {
    std::istringstream words(call);
    std::string part, what, equals, file, size;
    std::uint64_t not_before_us = 0, deadline_us = 0, number = 0, faults = 0, begin_us = 0;
    int code = 0, bits = 0, layout = 0;
    words >> part >> what >> not_before_us >> deadline_us >> equals >> code >> file >> size >>
        bits >> layout >> number >> faults >> begin_us;
    return words && part == "camera0" && what == "take" ? begin_us : 0;
}

struct Asker {
    rig_ports ports{};

    void transfer(std::istream &words) {
        std::uint64_t deadline_us = 0;
        std::string address, way, what;
        std::deque<std::vector<std::uint8_t>> data;
        std::vector<hal_i2c_message> messages;
        words >> deadline_us;
        while (words >> address && address != "=" && words >> way >> what) {
            const bool read = way == "r";
            data.push_back(read ? std::vector<std::uint8_t>(std::stoul(what)) : bytes_of(what));
            messages.push_back({data.back().data(), static_cast<std::uint16_t>(data.back().size()),
                                static_cast<std::uint8_t>(std::stoul(address, nullptr, 16)), read});
        }
        std::size_t begun = 0;
        ports.i2c->operations->transfer(ports.i2c->self, messages.data(), messages.size(),
                                        deadline_us, &begun);
    }

    void clock(const std::string &what, std::istream &words) const {
        std::uint64_t until_us = 0;
        if (what == "now") {
            ports.clock->operations->now_us(ports.clock->self);
        } else if (what == "wait" && words >> until_us) {
            ports.clock->operations->wait_until_us(ports.clock->self, until_us);
        }
    }

    void uart(const std::string &what, std::istream &words) const {
        const hal_uart *line = ports.lens_uart;
        std::uint64_t deadline_us = 0;
        std::string data;
        words >> deadline_us >> data;
        if (what == "discard") {
            line->operations->discard(line->self);
        } else if (what == "write") {
            const std::vector<std::uint8_t> sent = bytes_of(data);
            line->operations->write(line->self, sent.data(), sent.size(), deadline_us);
        } else if (what == "read") {
            std::vector<std::uint8_t> got(std::stoul(data));
            std::size_t count = 0;
            line->operations->read(line->self, got.data(), got.size(), deadline_us, &count);
        }
    }

    void gpio(const std::string &what, std::istream &words) const {
        unsigned line = 0;
        bool active = false;
        words >> line >> active;
        if (what == "set") {
            ports.gpio->operations->set(ports.gpio->self, hal_gpio_line(line), active);
        } else if (what == "get") {
            ports.gpio->operations->get(ports.gpio->self, hal_gpio_line(line), &active);
        }
    }

    void camera(const std::string &what, std::istream &words, std::uint64_t begin_us) {
        const hal_camera *port = ports.camera[0];
        if (what == "start") {
            hal_camera_format format{};
            char by = 0;
            words >> format.width_px >> by >> format.height_px;
            port->operations->start(port->self, &format);
        } else if (what == "stop") {
            port->operations->stop(port->self);
        } else if (what == "take") {
            std::uint64_t not_before_us = 0, deadline_us = 0;
            hal_camera_frame frame{};
            words >> not_before_us >> deadline_us;
            not_before_us = std::max(not_before_us + lead_us, begin_us) - lead_us;
            port->operations->take(port->self, not_before_us, deadline_us, &frame);
            raw_image_release(&frame.image);
        } else if (what == "counts") {
            hal_camera_counts counts{};
            port->operations->counts(port->self, &counts);
        }
    }

    void ask(const std::string &line) {
        std::istringstream words(line);
        std::string part, what;
        words >> part >> what;
        if (part == "clock") {
            clock(what, words);
        } else if (part == "i2c") {
            transfer(words);
        } else if (part == "uart") {
            uart(what, words);
        } else if (part == "gpio") {
            gpio(what, words);
        } else if (part == "camera0") {
            camera(what, words, begin_of(line));
        } else {
            give_up("no such call: " + line);
        }
    }
};

}  // namespace

int main(int count, char **arguments) {
    if (count != 3) {
        give_up("wants RIG SESSION; see its source");
    }
    message last_error{};
    auto backend = std::make_unique<sim_backend>();
    expect(sim_backend_open(backend.get(), arguments[1], timeout_ms), "cannot connect");
    const rig_ports inner = sim_backend_ports(backend.get());
    auto recorder = std::make_unique<record>();
    auto writer = std::make_unique<session_writer>();
    Asker asker;
    record_init(recorder.get(), &inner, &asker.ports);
    expect(session_writer_begin(writer.get(), AT_FDCWD, arguments[2], "test", "rig",
                                "2026-01-01T00:00:00Z", &last_error),
           last_error.text);
    expect(record_start(recorder.get(), writer.get(), &last_error), last_error.text);
    std::vector<std::string> calls;
    for (std::string line; std::getline(std::cin, line);) {
        calls.push_back(line);
    }
    std::size_t next = 0;  // the next call that returns a frame
    for (std::size_t i = 0; i < calls.size(); i++) {
        for (next = std::max(next, i); next < calls.size() && begin_of(calls[next]) == 0;) {
            next++;
        }
        if (next < calls.size() && backend->connection.now_us + lead_us >= begin_of(calls[next])) {
            hal_camera_frame none{};
            inner.camera[0]->operations->take(inner.camera[0]->self, 0, 0, &none);
            raw_image_release(&none.image);
        }
        asker.ask(calls[i]);
    }
    expect(record_stop(recorder.get(), &last_error), last_error.text);
    expect(session_writer_end(writer.get(), &last_error), last_error.text);
    sim_backend_close(backend.get());
    return 0;
}
