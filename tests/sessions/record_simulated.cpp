// SPDX-License-Identifier: Apache-2.0
// usage: record_simulated ADDRESS SESSION DATE WIDTH HEIGHT ZOOM FOCUS IRIS EXPOSURE_US LEFT RIGHT
// with the cameras' angles in 1e-6 rad.
//
// Connects to a running simrig as the board, brings the instrument up, sets it and takes a pair,
// all of it recorded into SESSION. Prints "captured" then, and waits for a line with the name of
// the calibration's file, which goes into the session before the pair. For tests/sessions/make.
#include <fcntl.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "daemon/record.h"
#include "daemon/session_write.h"
#include "daemon/version.h"
// In C a function may have the name of a structure.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#include "daemon/sim/sim_backend.h"
#pragma GCC diagnostic pop

namespace {

const int patience_ms = 60000;
const unsigned both_sides = 3;

[[noreturn]] void give_up(const std::string &why) {
    std::cerr << "record_simulated: " << why << "\n";
    std::exit(1);
}

void expect(int code, const char *why) {
    if (code != 0) {
        give_up(why);
    }
}

void set_up(rig *instrument, char **arguments) {
    const auto number = [&](int i) { return std::atoi(arguments[i]); };
    expect(rig_bringup(instrument), instrument->trouble.text);
    expect(rig_window(instrument, static_cast<std::uint16_t>(number(4)),
                      static_cast<std::uint16_t>(number(5)), 1),
           instrument->trouble.text);
    expect(rig_pan_both(instrument, number(10), number(11)), instrument->trouble.text);
    const lens_axis axes[] = {LENS_ZOOM, LENS_FOCUS, LENS_IRIS};
    for (int i = 0; i < 3; i++) {
        expect(rig_lens_go(instrument, both_sides, axes[i], number(6 + i)),
               instrument->trouble.text);
    }
    std::uint32_t applied_us = 0;
    expect(rig_exposure(instrument, both_sides, static_cast<std::uint32_t>(number(9)), &applied_us),
           instrument->trouble.text);
}

void write_calibration(session_writer *writer, message *trouble) {
    std::cout << "captured" << std::endl;
    std::string path;
    std::getline(std::cin, path);
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.empty()) {
        give_up(path + ": no calibration");
    }
    expect(session_writer_calibration(writer, text.data(), text.size(), trouble), trouble->text);
}

}  // namespace

int main(int count, char **arguments) {
    if (count != 12) {
        give_up("wants 11 arguments; see its source");
    }
    message trouble{};
    auto backend = std::make_unique<sim_backend>();
    expect(sim_backend_open(backend.get(), arguments[1], patience_ms), "cannot connect");
    const rig_ports inner = sim_backend_ports(backend.get());
    rig_ports ports{};
    auto recorder = std::make_unique<record>();
    record_init(recorder.get(), &inner, &ports);
    auto writer = std::make_unique<session_writer>();
    rig_profile profile{};
    expect(rig_profile_named("rig", &profile), "no profile");
    expect(session_writer_begin(writer.get(), AT_FDCWD, arguments[2], version_build_id(),
                                profile.name, arguments[3], &trouble),
           trouble.text);
    expect(record_start(recorder.get(), writer.get(), &trouble), trouble.text);
    auto instrument = std::make_unique<rig>();
    rig_init(instrument.get(), &profile, &ports, nullptr);
    set_up(instrument.get(), arguments);
    const pair_options options{};
    std::vector<std::uint16_t> memory(pair_values(instrument.get(), &options));
    pair taken{};
    expect(pair_capture(instrument.get(), &options, memory.data(), memory.size(), &taken),
           instrument->trouble.text);
    expect(record_stop(recorder.get(), &trouble), trouble.text);
    write_calibration(writer.get(), &trouble);
    expect(session_writer_pair(writer.get(), &taken, &trouble), trouble.text);
    expect(session_writer_end(writer.get(), &trouble), trouble.text);
    sim_backend_close(backend.get());
    return 0;
}
