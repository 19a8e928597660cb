// SPDX-License-Identifier: Apache-2.0
// The disk writer thread: no job is lost or reordered, and a waiting thread serves the instrument.
#include "daemon/session/disk_writer.h"

#include <doctest/doctest.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

namespace {

using namespace std::chrono_literals;

// A slow disk: jobs wait until it is opened, or for the time limit.
struct Gate {
    std::mutex lock;
    std::condition_variable opened;
    bool is_open = false;

    void open() {
        const std::lock_guard<std::mutex> held(lock);
        is_open = true;
        opened.notify_all();
    }
    bool wait(std::chrono::milliseconds limit) {
        std::unique_lock<std::mutex> held(lock);
        return opened.wait_for(held, limit, [this] { return is_open; });
    }
};

struct Note {
    disk_writer_task task = {};
    std::vector<std::size_t> *done = nullptr;
    std::size_t number = 0;
    Gate *gate = nullptr;
    std::chrono::milliseconds limit{60000};
    bool in_time = true;
};

void write_note(disk_writer_task *task) {
    auto *note = reinterpret_cast<Note *>(task);  // its first member
    note->in_time = note->gate == nullptr || note->gate->wait(note->limit);
    note->done->push_back(note->number);
}

void count(void *counter) {
    ++*static_cast<int *>(counter);
}

// Opens the gate at the fourth look.
struct Looks {
    Gate gate;
    int count = 0;
};

void look(void *self) {
    auto *looks = static_cast<Looks *>(self);
    if (++looks->count == 4) {
        looks->gate.open();
    }
}

TEST_CASE("a disk writer runs all jobs in order, and a waiting thread serves the instrument") {
    disk_writer writer = {};
    Looks looks;
    writer.meanwhile = look;
    writer.self = &looks;
    writer.held_max_bytes = 1 << 20;
    REQUIRE(disk_writer_start(&writer));
    std::vector<std::size_t> done;
    std::array<Note, 20> notes;
    // Queueing a job does not wait for it: the gate is still closed.
    for (std::size_t i = 0; i < 20; i++) {
        notes.at(i) = {{write_note, 1, nullptr}, &done, i, &looks.gate};
        disk_writer_submit(&writer, &notes.at(i).task);
    }
    CHECK(looks.count == 0);
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
    CHECK(looks.count >= 4);
    for (std::size_t i = 0; i < 20; i++) {
        CHECK(done.at(i) == i);
        CHECK(notes.at(i).in_time);
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
        notes.at(i) = {{write_note, 501, nullptr}, &done, i, nullptr};
    }
    // The first job waits in vain for the submission of the last one to return.
    Gate submitted;
    notes[0].gate = &submitted;
    notes[0].limit = 100ms;
    disk_writer_submit(&writer, &notes[0].task);
    disk_writer_submit(&writer, &notes[1].task);
    disk_writer_submit(&writer, &notes[2].task);
    submitted.open();
    disk_writer_stop(&writer);
    CHECK_FALSE(notes[0].in_time);
    CHECK(done == std::vector<std::size_t>{0, 1, 2});
}

TEST_CASE("without a disk writer the caller runs its jobs") {
    std::vector<std::size_t> done;
    Note note = {{write_note, 1, nullptr}, &done, 1, nullptr};
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
