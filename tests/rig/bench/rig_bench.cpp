// SPDX-License-Identifier: Apache-2.0
#include "bench/rig_bench.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdio>
#include <cstdlib>

#include "console/command.h"
#include "core/invariant.h"

void invariant_failed(const char *file, int line, const char *condition) {
    std::fprintf(stderr, "internal error at %s:%d: %s\n", file, line, condition);
    std::abort();
}

namespace rig_bench {

namespace {

constexpr uint64_t kIdleStepMs = 50;

void write_log(void *self, hal_log_level, const char *text) {
    static_cast<std::vector<std::string> *>(self)->push_back(text);
}

bool ask_should_stop(void *self) {
    return !(*static_cast<std::function<bool()> *>(self))();
}

rig_ports opened(sim_backend &backend, const std::string &where) {
    const int error = sim_backend_open(&backend, where.c_str(), SIM_CONNECTION_TIMEOUT_MS);
    REQUIRE_MESSAGE(error == ERROR_OK, backend.connection.text);
    return sim_backend_ports(&backend);
}

}  // namespace

rig_profile small_profile(uint16_t width_px, uint16_t height_px) {
    rig_profile profile{};
    REQUIRE(rig_profile_named("rig", &profile) == ERROR_OK);
    profile.width_px = width_px;
    profile.height_px = height_px;
    return profile;
}

RigBench::RigBench(const rig_profile &profile, const std::string &scene)
    : process(scene), faulty(opened(backend, process.where())) {
    REQUIRE(sim_connection_open(&control_connection, process.where().c_str(), SIMRIG_ROLE_CONTROL,
                                SIM_CONNECTION_TIMEOUT_MS) == ERROR_OK);
    static constexpr hal_log_operations kLogOperations = {write_log};
    log_ = {&kLogOperations, &logged};
    rig_ports ports = faulty.ports();
    ports.log = &log_;
    const rig_observer observer = {ask_should_stop, nullptr, &keep_going};
    rig_init(&rig, &profile, &ports, &observer);
}

RigBench::~RigBench() {
    pair_release(taken_);
    sim_connection_close(&control_connection);
    sim_backend_close(&backend);
}

uint64_t RigBench::now_us() {
    return backend.clock.operations->now_us(backend.clock.self);
}

void RigBench::advance_ms(uint64_t time_ms) {
    backend.clock.operations->wait_until_us(backend.clock.self, now_us() + 1000 * time_ms);
}

int RigBench::idle_ms(uint64_t time_ms) {
    int first = ERROR_OK;
    for (uint64_t passed = 0; passed < time_ms; passed += kIdleStepMs) {
        const int error = rig_serve(&rig);
        first = first == ERROR_OK ? error : first;
        advance_ms(kIdleStepMs);
    }
    return first;
}

std::string RigBench::control(const std::string &command) {
    char answer[4096];
    const int error =
        sim_connection_control(&control_connection, command.c_str(), answer, sizeof answer);
    REQUIRE_MESSAGE(error == ERROR_OK, control_connection.text);
    return answer;
}

int RigBench::capture(::pair &pair, bool check_static) {
    const pair_options options = {check_static, 0, 0, 0, nullptr};
    pair_release(taken_);
    const int error = pair_capture(&rig, &options, &pair);
    if (error == ERROR_OK) {
        taken_[RIG_LEFT] = pair.frame[RIG_LEFT];
        taken_[RIG_RIGHT] = pair.frame[RIG_RIGHT];
    }
    return error;
}

double RigBench::mean(const pair_frame &frame) const {
    const raw_image &image = frame.image;
    double sum = 0;
    for (int y = 0; y < image.height_px; y++) {
        for (int x = 0; x < image.width_px; x++) {
            sum += raw_image_row(&image, y)[x];
        }
    }
    return sum / image.width_px / image.height_px;
}

int RigBench::run(const std::string &line, std::string &message) {
    std::size_t count = 0;
    const command *table = command_rig_table(&count);
    std::array<char, COMMAND_LINE_MAX + 1> storage{};
    std::array<char, 512> text{};
    std::array<command_value, COMMAND_ARGUMENTS_MAX> values{};
    const command *found = nullptr;
    REQUIRE(command_parse(line.c_str(), table, count, storage.data(), values.data(), &found,
                          text.data(), text.size()) == 0);
    REQUIRE(found != nullptr);
    command_call call{};
    call.rig = &rig;
    call.values = values.data();
    call.message = text.data();
    call.message_bytes = text.size();
    const int error = command_run(found, &call);
    message = text.data();
    return error;
}

}  // namespace rig_bench
