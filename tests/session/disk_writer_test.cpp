// SPDX-License-Identifier: Apache-2.0
// The disk writer thread: no job is lost or reordered, and a waiting thread serves the instrument.
#include "daemon/session/disk_writer.h"

#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <thread>
#include <vector>

namespace {

using namespace std::chrono_literals;

struct Note {
    disk_writer_task task = {};
    std::vector<std::size_t> *done = nullptr;
    std::size_t number = 0;
    std::chrono::milliseconds takes{0};
};

void write_note(disk_writer_task *task) {
    auto *note = reinterpret_cast<Note *>(task);  // its first member
    std::this_thread::sleep_for(note->takes);
    note->done->push_back(note->number);
}

void count(void *counter) {
    ++*static_cast<int *>(counter);
}

TEST_CASE("a disk writer runs all jobs in order, and a waiting thread serves the instrument") {
    disk_writer writer = {};
    int looks = 0;
    writer.meanwhile = count;
    writer.self = &looks;
    writer.held_max_bytes = 1 << 20;
    REQUIRE(disk_writer_start(&writer));
    std::vector<std::size_t> done;
    std::array<Note, 20> notes;
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < 20; i++) {
        notes.at(i) = {{write_note, 1, nullptr}, &done, i, 20ms};
        disk_writer_submit(&writer, &notes.at(i).task);
    }
    // Queueing a job does not wait for it.
    CHECK(std::chrono::steady_clock::now() - begin < 300ms);
    CHECK(looks == 0);
    struct Last {
        std::vector<std::size_t> *done;
        std::size_t before;
    } last = {&done, 0};
    disk_writer_run(
        &writer,
        [](void *cookie) {
            auto *self = static_cast<Last *>(cookie);
            self->before = self->done->size();
        },
        &last);
    CHECK(last.before == 20);
    CHECK(looks >= 4);  // 400 ms, of which the making of the notes took some
    for (std::size_t i = 0; i < 20; i++) {
        CHECK(done.at(i) == i);
    }
    // Stopping waits for queued jobs.
    disk_writer_submit(&writer, &notes[7].task);
    disk_writer_stop(&writer);
    CHECK(done.size() == 21);
}

TEST_CASE("a disk writer holds no more than its limit") {
    disk_writer writer = {};
    writer.held_max_bytes = 1000;
    REQUIRE(disk_writer_start(&writer));
    std::vector<std::size_t> done;
    std::array<Note, 3> notes;
    for (std::size_t i = 0; i < 3; i++) {
        notes.at(i) = {{write_note, 501, nullptr}, &done, i, 100ms};
    }
    disk_writer_submit(&writer, &notes[0].task);
    disk_writer_submit(&writer, &notes[1].task);
    const auto begin = std::chrono::steady_clock::now();
    disk_writer_submit(&writer, &notes[2].task);
    CHECK(std::chrono::steady_clock::now() - begin > 50ms);
    disk_writer_stop(&writer);
    CHECK(done == std::vector<std::size_t>{0, 1, 2});
}

TEST_CASE("without a disk writer the caller runs its jobs") {
    std::vector<std::size_t> done;
    Note note = {{write_note, 1, nullptr}, &done, 1, 0ms};
    int counter = 0;
    disk_writer idle = {};
    disk_writer_submit(nullptr, &note.task);
    disk_writer_run(nullptr, count, &counter);
    disk_writer_run(&idle, count, &counter);
    disk_writer_stop(&idle);
    CHECK(done.size() == 1);
    CHECK(counter == 2);
}

}  // namespace
