// SPDX-License-Identifier: Apache-2.0
// hal_uart on a pseudo terminal, whose calls the fake kernel records and breaks.
#include "daemon/backends/linux/termios_uart.h"

#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "core/error.h"
#include "daemon/backends/linux/monotonic_clock.h"
#include "daemon/base/monotonic.h"
#include "linux_harness.hpp"

namespace {

using linux_harness::Kernel;
using linux_harness::record;

// The other end of a serial line. Real time: the kernel moves the bytes at its own pace.
struct Line {
    Kernel kernel;
    int master = -1;
    std::string path;

    Line() {
        int slave = -1;
        char name[64];
        REQUIRE(openpty(&master, &slave, name, nullptr, nullptr) == 0);
        path = name;
        ::close(slave);
        fake_kernel_reset();
        fake_kernel_watch(name);
    }
    ~Line() { hang_up(); }
    void hang_up() {
        if (master >= 0) {
            ::close(master);
        }
        master = -1;
    }
    std::string name() const { return path.substr(path.rfind('/') + 1); }
};

struct Uart {
    termios_uart uart{};
    message text{};

    explicit Uart(const Line &line) {
        REQUIRE(termios_uart_open(&uart, line.path.c_str(), 9600, &text) == ERROR_OK);
    }
    ~Uart() { termios_uart_close(&uart); }

    int write(const std::string &bytes, uint64_t wait_us = 200000) {
        return uart.hal.operations->write(uart.hal.self, bytes.data(), bytes.size(),
                                          monotonic_now_us() + wait_us);
    }
    int read(std::string *bytes, uint64_t wait_us = 200000, size_t capacity = 64) {
        bytes->assign(capacity, '?');
        size_t got = 0;
        const int error = uart.hal.operations->read(uart.hal.self, &(*bytes)[0], capacity,
                                                    monotonic_now_us() + wait_us, &got);
        bytes->resize(error == ERROR_OK ? got : 0);
        return error;
    }
    // Waits until this many bytes can be read; the calls are not recorded.
    void await_bytes(int count) const {
        const uint64_t end_us = monotonic_now_us() + 60000000;
        int pending = 0;
        while (pending < count) {
            REQUIRE(monotonic_now_us() < end_us);
            REQUIRE(::syscall(SYS_ioctl, uart.fd, FIONREAD, &pending) == 0);
            std::this_thread::yield();
        }
    }
    int discard() { return uart.hal.operations->discard(uart.hal.self); }
};

std::string take(int fd, size_t bytes) {
    std::string text(bytes, '?');
    size_t got = 0;
    while (got < bytes) {
        const ssize_t more = ::read(fd, &text[got], bytes - got);
        REQUIRE(more > 0);
        got += static_cast<size_t>(more);
    }
    return text;
}

}  // namespace

TEST_CASE("the line is exclusive, even for root") {
    const Line line;
    {
        const Uart uart(line);
        termios_uart second;
        message text;
        CHECK(termios_uart_open(&second, line.path.c_str(), 9600, &text) == ERROR_REFUSED);
        CHECK(second.fd == -1);
        // A second program of root gets this far; the kernel refuses other users.
        int exclusive = 0;
        REQUIRE(::ioctl(uart.uart.fd, TIOCGEXCL, &exclusive) == 0);
        CHECK(exclusive == 1);
        CHECK(std::string(text.text).find("another program") != std::string::npos);
    }
    const Uart later(line);
    CHECK(later.uart.fd >= 0);
}

TEST_CASE("reading and writing end at the deadline") {
    const Line line;
    Uart uart(line);
    std::string got;
    uint64_t begin_us = monotonic_now_us();
    CHECK(uart.read(&got, 30000) == ERROR_TIMEOUT);
    uint64_t took_us = monotonic_now_us() - begin_us;
    CHECK(took_us >= 30000);
    CHECK(took_us < 2000000);
    CHECK(uart.read(&got, 0) == ERROR_TIMEOUT);
    // The bytes are not read, so the buffer fills up.
    begin_us = monotonic_now_us();
    CHECK(uart.write(std::string(1000000, 'x'), 30000) == ERROR_TIMEOUT);
    took_us = monotonic_now_us() - begin_us;
    CHECK(took_us >= 30000);
    CHECK(took_us < 2000000);
}

TEST_CASE("an available byte is read even after the deadline") {
    const Line line;
    Uart uart(line);
    REQUIRE(::write(line.master, "a", 1) == 1);
    uart.await_bytes(1);
    std::string got;
    CHECK(uart.read(&got, 0) == ERROR_OK);
    CHECK(got == "a");
}

TEST_CASE("discard drops received bytes") {
    const Line line;
    Uart uart(line);
    REQUIRE(::write(line.master, "old", 3) == 3);
    uart.await_bytes(3);
    record();
    CHECK(uart.discard() == ERROR_OK);
    CHECK(record() == line.name() + " tcflush in\n");
    REQUIRE(::write(line.master, "new", 3) == 3);
    std::string got;
    CHECK(uart.read(&got) == ERROR_OK);
    CHECK(got == "new");
    fake_kernel_fail("tcflush", 1, EIO, 1);
    CHECK(uart.discard() == ERROR_DEVICE);
}

TEST_CASE("after a hang-up the received bytes are read, then the line is gone") {
    Line line;
    Uart uart(line);
    REQUIRE(::write(line.master, "last", 4) == 4);
    uart.await_bytes(4);
    std::thread unplug([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        line.hang_up();
    });
    std::string got;
    const int first = uart.read(&got, 1000000);
    CHECK(first == ERROR_OK);
    CHECK(got == "last");
    const uint64_t begin_us = monotonic_now_us();
    CHECK(uart.read(&got, 5000000) == ERROR_DEVICE);
    CHECK(monotonic_now_us() - begin_us < 4000000);  // returned at once, not at the deadline
    unplug.join();
    CHECK(uart.write("x") == ERROR_DEVICE);
}

TEST_CASE("a byte taken by another reader is not a hang-up") {
    const Line line;
    Uart uart(line);
    const int second_fd = dup(uart.uart.fd);
    REQUIRE(second_fd >= 0);
    fake_kernel_slow(" read", 500);
    REQUIRE(::write(line.master, "a", 1) == 1);
    char stolen = '?';
    fake_kernel_forget();
    std::thread other([&] {
        while (fake_kernel_calls() < 2) {  // it has seen the byte and is about to read it
            std::this_thread::yield();
        }
        ::syscall(SYS_read, second_fd, &stolen, 1);
    });
    std::string got;
    CHECK(uart.read(&got, 600000) == ERROR_TIMEOUT);
    other.join();
    REQUIRE(stolen == 'a');
    REQUIRE(::write(line.master, "b", 1) == 1);
    CHECK(uart.read(&got, 2000000) == ERROR_OK);
    CHECK(got == "b");
    ::close(second_fd);
}

TEST_CASE("signals and short writes change nothing") {
    const Line line;
    for (const char *call : {"poll", "write", "read"}) {
        for (const int error : {EINTR, EAGAIN}) {
            if (std::string(call) == "poll" && error == EAGAIN) {
                continue;
            }
            Uart uart(line);
            fake_kernel_fail(call, 1, error, 3);
            std::string got;
            CHECK(uart.write("hello") == ERROR_OK);
            CHECK(take(line.master, 5) == "hello");
            REQUIRE(::write(line.master, "world", 5) == 5);
            CHECK(uart.read(&got, 1000000) == ERROR_OK);
            CHECK(got == "world");
            CHECK(fake_kernel_failed());
        }
    }
    Uart uart(line);
    fake_kernel_short(" write", 1, 2);
    CHECK(uart.write("12345678") == ERROR_OK);
    CHECK(take(line.master, 8) == "12345678");
    CHECK(fake_kernel_failed());
}

TEST_CASE("every errno of poll, read and write maps to the interface's error") {
    const Line line;
    const struct {
        int system, ours;
    } pairs[] = {{EIO, ERROR_DEVICE},
                 {ENODEV, ERROR_DEVICE},
                 {ENXIO, ERROR_DEVICE},
                 {ENOMEM, ERROR_IO},
                 {EINVAL, ERROR_IO}};
    for (const auto &pair : pairs) {
        CAPTURE(pair.system);
        Uart uart(line);
        std::string got;
        fake_kernel_fail(" write", 1, pair.system, 1);
        CHECK(uart.write("x") == pair.ours);
        fake_kernel_fail(" read", 1, pair.system, 1);
        REQUIRE(::write(line.master, "y", 1) == 1);
        CHECK(uart.read(&got) == pair.ours);
        fake_kernel_fail(" poll", 1, pair.system, 1);
        CHECK(uart.read(&got) == ERROR_IO);
        fake_kernel_fail(" poll", 1, pair.system, 1);
        CHECK(uart.write("x") == ERROR_IO);
    }
}

TEST_CASE("each call of opening fails in turn: an error, and nothing open") {
    Line line;
    for (const int error : linux_harness::kErrors) {
        message text;
        for (unsigned nth = 1; nth <= 7; nth++) {
            CAPTURE(nth);
            CAPTURE(error);
            const long before = linux_harness::open_descriptors();
            fake_kernel_reset();
            fake_kernel_watch(line.path.c_str());
            fake_kernel_fail("", nth, error, 1);
            termios_uart uart;
            CHECK(termios_uart_open(&uart, line.path.c_str(), 9600, &text) != ERROR_OK);
            CHECK(fake_kernel_failed());
            CHECK(uart.fd == -1);
            CHECK(std::string(text.text).find(line.path) != std::string::npos);
            CHECK(linux_harness::open_descriptors() == before);
        }
    }
}

TEST_CASE("non-terminals and unsupported speeds are rejected in one line") {
    const Kernel kernel;
    termios_uart uart;
    message text;
    CHECK(termios_uart_open(&uart, "/dev/null", 9600, &text) == ERROR_UNSUPPORTED);
    CHECK(std::string(text.text).find("serial line /dev/null: cannot set 9600 bit/s") == 0);
    CHECK(termios_uart_open(&uart, "/dev/null", 9601, &text) == ERROR_UNSUPPORTED);
    CHECK(termios_uart_open(&uart, "/dev/ttyNONE", 9600, &text) == ERROR_DEVICE);
    CHECK(uart.fd == -1);
}
