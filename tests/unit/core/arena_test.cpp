// SPDX-License-Identifier: Apache-2.0
#include "core/arena.h"

#include <doctest/doctest.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace {

struct Fixture {
    alignas(ARENA_ALIGNMENT) std::array<unsigned char, 4096> memory{};
    alignas(ARENA_ALIGNMENT) std::array<unsigned char, 256 + 2 * ARENA_ALIGNMENT> near_bank{};
    alignas(ARENA_ALIGNMENT) std::array<unsigned char, 128 + 2 * ARENA_ALIGNMENT> nearer_bank{};
    unsigned char *const near = near_bank.data() + ARENA_ALIGNMENT;
    unsigned char *const nearer = nearer_bank.data() + ARENA_ALIGNMENT;
    arena lent{};

    Fixture() {
        arena_init(&lent, memory.data(), memory.size());
        arena_lend_fast(&lent, nearer_bank.data(), nearer_bank.size());
        arena_lend_fast(&lent, near_bank.data(), near_bank.size());
    }
};

TEST_CASE_FIXTURE(Fixture, "Fast memory is taken where it fits, and the rest where it does not") {
    CHECK(arena_take_fast(&lent, 100, 1) == nearer);
    CHECK(arena_take_fast(&lent, 100, 1) == near);
    CHECK(arena_take_fast(&lent, 100, 1) == near + 128);
    const size_t before = lent.used_bytes;
    CHECK(arena_take_fast(&lent, 100, 1) >= memory.data() + before);
    CHECK(arena_take_fast(&lent, SIZE_MAX, 2) == nullptr);
}

TEST_CASE_FIXTURE(Fixture, "What was taken since a mark is fast memory again") {
    REQUIRE(arena_take_fast(&lent, 25, 4) == nearer);
    const size_t mark = arena_mark(&lent);
    REQUIRE(arena_take_fast(&lent, 256, 1) == near);
    arena_release(&lent, mark);
    CHECK(arena_take_fast(&lent, 256, 1) == near);
    arena_release(&lent, 0);
    CHECK(arena_take_fast(&lent, 128, 1) == nearer);
}

TEST_CASE_FIXTURE(Fixture, "The rest of an arena has what is free of both") {
    REQUIRE(arena_take_fast(&lent, 64, 1) == nearer);
    arena rest = arena_rest(&lent);
    CHECK(arena_take_fast(&rest, 64, 1) == nearer + 64);
    CHECK(arena_take_fast(&rest, 256, 1) == near);
    CHECK(arena_take(&rest, 1, 1) >= memory.data() + lent.used_bytes);
    arena_release(&rest, 0);
    CHECK(arena_take_fast(&rest, 64, 1) == nearer + 64);
    CHECK(arena_take_fast(&lent, 64, 1) == nearer + 64);
}

TEST_CASE_FIXTURE(Fixture, "It takes no more of the rest than without fast memory") {
    for (size_t bytes = 1; bytes < 256; bytes += 5) {
        arena_release(&lent, 0);
        REQUIRE(arena_take(&lent, 1, 1) != nullptr);
        const size_t before = lent.used_bytes;
        REQUIRE(arena_take_fast(&lent, bytes, 1) != nullptr);
        CHECK(lent.used_bytes - before <= arena_need_bytes(bytes, 1));
    }
}

}  // namespace
