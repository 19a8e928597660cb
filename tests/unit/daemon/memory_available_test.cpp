// SPDX-License-Identifier: Apache-2.0
// How much memory is available, also if /proc does not state it.
#include <doctest/doctest.h>
#include <sys/sysinfo.h>

#include <algorithm>
#include <cstdint>
#include <string>

#include "daemon/base/memory.h"
#include "daemon/files/free_space.h"
#include "tests/scratch.hpp"

namespace {

TEST_CASE("available memory is what the kernel states") {
    const scratch folder;
    const std::string file =
        folder.write("meminfo",
                     "MemTotal: 4000 kB\nMemFree: 10 kB\nMemAvailable:   3000 kB\n"
                     "SwapTotal: 900 kB\nSwapFree:      500 kB\n");
    CHECK(memory_available_as_in(file.c_str(), "") == 3500 * 1024);
}

TEST_CASE("a system that promises no more than it has limits what is available") {
    const scratch folder;
    const std::string file = folder.write("meminfo",
                                          "MemAvailable: 3000 kB\nSwapFree: 500 kB\n"
                                          "CommitLimit: 4000 kB\nCommitted_AS: 2800 kB\n");
    const std::string full = folder.write(
        "full", "MemAvailable: 3000 kB\nCommitLimit: 4000 kB\nCommitted_AS: 4100 kB\n");
    const std::string strict = folder.write("strict", "2\n"), usual = folder.write("usual", "0\n");
    CHECK(memory_available_as_in(file.c_str(), strict.c_str()) == 1200 * 1024);
    CHECK(memory_available_as_in(file.c_str(), usual.c_str()) == 3500 * 1024);
    CHECK(memory_available_as_in(full.c_str(), strict.c_str()) == 0);
}

TEST_CASE("if the kernel does not state it, free memory counts, not all memory") {
    const scratch folder;
    const std::string silent = folder.write("meminfo", "MemTotal: 4000 kB\nSwapFree: 500 kB\n");
    for (const std::string &file : {silent, folder / "none"}) {
        // Other processes allocate and free meanwhile: the value is between two readings, or near.
        struct sysinfo before = {}, after = {};
        REQUIRE(sysinfo(&before) == 0);
        const std::uint64_t bytes = memory_available_as_in(file.c_str(), "");
        REQUIRE(sysinfo(&after) == 0);
        const auto unused = [](const struct sysinfo &all) {
            return (std::uint64_t{all.freeram} + all.bufferram + all.freeswap) * all.mem_unit;
        };
        const std::uint64_t slack = std::uint64_t{before.totalram} * before.mem_unit / 20;
        CHECK(bytes <= std::max(unused(before), unused(after)) + slack);
        CHECK(bytes + slack >= std::min(unused(before), unused(after)));
    }
    CHECK(memory_available_bytes() > 0);
}

TEST_CASE("files in memory may take what a job frees before it writes them") {
    free_space available{};
    available.memory_bytes = 30;
    available.files_bytes = 20;
    available.files_in_memory = true;
    free_space need{};
    need.memory_bytes = 25;
    need.files_bytes = 12;
    CHECK_FALSE(free_space_fits(&available, &need));
    need.freed_bytes = 7;
    CHECK(free_space_memory_bytes(&available, &need) == 30);
    CHECK(free_space_fits(&available, &need));
    need.freed_bytes = 25;
    CHECK(free_space_memory_bytes(&available, &need) == 25);
    need.files_bytes = 21;
    CHECK_FALSE(free_space_fits(&available, &need));
}

}  // namespace
