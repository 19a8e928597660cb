// SPDX-License-Identifier: Apache-2.0
// Records the whole instrument on the simulated rig, then replays the same commands from the
// recording alone: the pair is identical to the last byte.
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>

#include "daemon/backends/replay/replay.h"
#include "daemon/session/record.h"
// In C a function may have the same name as a structure.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#include "daemon/backends/sim/sim_backend.h"
#pragma GCC diagnostic pop
#include "scratch.hpp"
#include "session_harness.hpp"

using namespace session_harness;

namespace {

/// A simrig process that ends with this object.
struct running_rig {
    pid_t process;
    std::string where;

    explicit running_rig(const scratch &folder) : where("unix:" + (folder / "rig.sock")) {
        const char *program = std::getenv("SIMRIG");
        REQUIRE(program != nullptr);
        process = fork();
        REQUIRE(process >= 0);
        if (process == 0) {
            const std::string quiet = "/dev/null";
            if (freopen(quiet.c_str(), "w", stdout) == nullptr) {
                _exit(1);
            }
            execl(program, "simrig", "--scene", "cylinder", "--listen", where.c_str(), "--seed",
                  "5", static_cast<char *>(nullptr));
            _exit(1);
        }
        const std::string socket = folder / "rig.sock";
        for (int i = 0; access(socket.c_str(), F_OK) != 0; i++) {
            REQUIRE(i < 3000);
            usleep(20000);
        }
    }
    ~running_rig() {
        kill(process, SIGTERM);
        waitpid(process, nullptr, 0);
    }
    running_rig(const running_rig &) = delete;
    running_rig &operator=(const running_rig &) = delete;
};

/// The commands that are recorded and replayed: everything that a session may contain.
struct session_of_commands {
    std::vector<int> codes;
    struct pair taken {};

    session_of_commands() = default;
    session_of_commands(const session_of_commands &) = delete;
    session_of_commands &operator=(const session_of_commands &) = delete;
    ~session_of_commands() { release(); }

    void run(const rig_ports &ports, session_writer *writer, record *recorder) {
        auto instrument = std::make_unique<rig>();
        rig_profile profile{};
        REQUIRE(rig_profile_named("rig", &profile) == 0);
        rig_init(instrument.get(), &profile, &ports, nullptr);
        codes.push_back(rig_bringup(instrument.get()));
        INFO(std::string(instrument->last_error.text));
        idle(instrument.get(), recorder);
        codes.push_back(rig_window(instrument.get(), 64, 48, 1));
        codes.push_back(rig_lens_move_to(instrument.get(), 3, LENS_ZOOM, 320));
        std::uint32_t applied_us = 0;
        codes.push_back(rig_exposure(instrument.get(), 3, 5000, &applied_us));
        codes.push_back(static_cast<int>(applied_us));
        for (int i = 0; i < 2; i++) {
            idle(instrument.get(), recorder);
            const pair_options options{i == 1};
            release();
            const int code = pair_capture(instrument.get(), &options, &taken);
            codes.push_back(code);
            message last_error{};
            if (writer != nullptr && code == 0) {
                REQUIRE(record_flush(recorder, &last_error) == 0);
                REQUIRE(session_writer_pair(writer, &taken, &last_error) == 0);
            }
        }
        codes.push_back(rig_safe(instrument.get()));
    }

  private:
    static void idle(rig *instrument, record *recorder) {
        CHECK((recorder != nullptr ? record_idle(recorder, instrument) : rig_idle(instrument)) ==
              0);
    }
    void release() { pair_release(taken.frame); }
};

}  // namespace

TEST_CASE("a recorded session replays bit for bit like the instrument") {
    const scratch folder;
    const std::string path = folder / "session";
    session_of_commands first, again;
    message last_error{};
    {
        const running_rig simulated(folder);
        auto backend = std::make_unique<sim_backend>();
        INFO(std::string(backend->connection.text));
        REQUIRE(sim_backend_open(backend.get(), simulated.where.c_str(), 60000) == 0);
        const rig_ports inner = sim_backend_ports(backend.get());
        rig_ports ports{};
        auto recorder = std::make_unique<record>();
        record_init(recorder.get(), &inner, &ports);
        auto writer = new_writer();
        REQUIRE(session_writer_begin(writer.get(), AT_FDCWD, path.c_str(), "v1", "rig", "now",
                                     &last_error) == 0);
        REQUIRE(record_start(recorder.get(), writer.get(), &last_error) == 0);
        first.run(ports, writer.get(), recorder.get());
        CHECK(record_stop(recorder.get(), &last_error) == 0);
        CHECK(session_writer_end(writer.get(), &last_error) == 0);
        MESSAGE("recorded calls: ", recorder->calls);
        sim_backend_close(backend.get());
    }
    CHECK(first.codes[0] == 0);
    REQUIRE(first.taken.frame[0].image.data != nullptr);

    auto player = std::make_unique<replay>();
    const int opened = replay_open(player.get(), AT_FDCWD, path.c_str(), nullptr, &last_error);
    INFO(std::string(last_error.text));
    REQUIRE(opened == 0);
    again.run(player->ports, nullptr, nullptr);
    CHECK(std::string(player->last_error.text) == "");
    CHECK(replay_is_over(player.get()));
    replay_close(player.get());
    CHECK(again.codes == first.codes);
    for (int side = 0; side < RIG_SIDES; side++) {
        const pair_frame &one = again.taken.frame[side], &other = first.taken.frame[side];
        CHECK(same_frame(one, other));
        CHECK(same_pixels(one.image, other.image));
    }
    // The index contains the same pair.
    session_reader reader;
    auto event = std::make_unique<session_event>();
    REQUIRE(session_reader_open(&reader, AT_FDCWD, path.c_str(), nullptr, &last_error) == 0);
    bool found = false;
    while (session_reader_next(&reader, event.get(), &last_error) == 1) {
        found |= event->kind == SESSION_PAIR && same_pair(reader, *event, again.taken);
    }
    CHECK(found);
    session_reader_close(&reader);
}
