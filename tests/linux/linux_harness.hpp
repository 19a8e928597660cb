// SPDX-License-Identifier: Apache-2.0
/// A fake kernel for one test: reset at the start; at the end no descriptor may be open.
#ifndef VERGENCE_TESTS_LINUX_HARNESS_HPP
#define VERGENCE_TESTS_LINUX_HARNESS_HPP

#include <doctest/doctest.h>

#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "fake_kernel.h"
#include "scratch.hpp"

namespace linux_harness {

inline long open_descriptors() {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return std::distance(begin(all), end(all));
}

/// Start of virtual time, so that a time near 0 is never right by chance.
constexpr uint64_t kStart_us = 1000000000;

struct Kernel {
    long before;

    Kernel() : before(open_descriptors()) {
        fake_kernel_reset();
        fake_kernel_virtual_time(kStart_us);
    }
    Kernel(const Kernel &) = delete;
    Kernel &operator=(const Kernel &) = delete;
    ~Kernel() {
        CHECK(open_descriptors() == before);
        fake_kernel_reset();
    }
};

/// A file whose existence means that a device is plugged in (fake_kernel_plug).
struct Plug {
    scratch folder;
    std::string file = folder / "plug";

    void in() const { std::ofstream(file).put('x'); }
    void out() const { std::filesystem::remove(file); }
};

/// The record since the last call of this function.
inline std::string record() {
    std::string text = fake_kernel_record();
    fake_kernel_forget();
    return text;
}

/// Errors of permanent failures.
constexpr int kErrors[] = {EIO, ENODEV, ENXIO, EBUSY, EACCES, ENOMEM, EINVAL, ENOTTY, ETIMEDOUT};

/// Makes each call of `scenario` fail with `error` in turn, `times` times (0: also forever), and
/// calls `check` with its result. `scenario` gets a fresh kernel each time.
inline void each_call_fails(int error, unsigned times, const std::function<int()> &scenario,
                            const std::function<void(unsigned, int)> &check) {
    for (unsigned nth = 1;; nth++) {
        const Kernel kernel;
        fake_kernel_fail("", nth, error, times);
        const int result = scenario();
        if (!fake_kernel_failed()) {
            return;  // no more calls
        }
        INFO("call ", nth, " fails with ", error, "; record:\n", std::string(fake_kernel_record()));
        check(nth, result);
    }
}

}  // namespace linux_harness

#endif
