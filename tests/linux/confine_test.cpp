// SPDX-License-Identifier: Apache-2.0
// The device requests allowed to the confined daemon: those of the backends, and no others.
#include "daemon/server/confine.h"

#include <doctest/doctest.h>
#include <linux/gpio.h>
#include <linux/i2c-dev.h>
#include <linux/i2c.h>
#include <linux/kd.h>
#include <linux/videodev2.h>
#include <linux/vt.h>
#include <linux/watchdog.h>
#include <mtd/mtd-user.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "core/error.h"

namespace {

struct Request {
    std::string name;
    uint64_t number;
};

#define REQUEST(name) \
    { #name, static_cast < uint64_t>(name) }

// Requests of daemon/backends/linux, the console, and both versions of libgpiod.
const std::vector<Request> kOurs = {
    REQUEST(VIDIOC_QUERYCAP),
    REQUEST(VIDIOC_S_FMT),
    REQUEST(VIDIOC_G_PARM),
    REQUEST(VIDIOC_S_PARM),
    REQUEST(VIDIOC_REQBUFS),
    REQUEST(VIDIOC_QUERYBUF),
    REQUEST(VIDIOC_QBUF),
    REQUEST(VIDIOC_DQBUF),
    REQUEST(VIDIOC_STREAMON),
    REQUEST(VIDIOC_STREAMOFF),
    REQUEST(VIDIOC_S_CTRL),
    REQUEST(VIDIOC_G_CTRL),
    REQUEST(VIDIOC_QUERYCTRL),
    REQUEST(MEMGETINFO),
    REQUEST(MEMERASE),
    REQUEST(I2C_RDWR),
    REQUEST(I2C_FUNCS),
    REQUEST(I2C_TIMEOUT),
    REQUEST(I2C_RETRIES),
    REQUEST(GPIO_GET_CHIPINFO_IOCTL),
    REQUEST(GPIO_GET_LINEINFO_IOCTL),
    REQUEST(GPIO_GET_LINEHANDLE_IOCTL),
    REQUEST(GPIO_GET_LINEEVENT_IOCTL),
    REQUEST(GPIOHANDLE_GET_LINE_VALUES_IOCTL),
    REQUEST(GPIOHANDLE_SET_LINE_VALUES_IOCTL),
    REQUEST(GPIO_V2_GET_LINEINFO_IOCTL),
    REQUEST(GPIO_V2_GET_LINE_IOCTL),
    REQUEST(GPIO_V2_LINE_GET_VALUES_IOCTL),
    REQUEST(GPIO_V2_LINE_SET_VALUES_IOCTL),
    REQUEST(WDIOC_GETSUPPORT),
    REQUEST(WDIOC_KEEPALIVE),
    REQUEST(WDIOC_SETTIMEOUT),
    REQUEST(WDIOC_GETTIMEOUT),
    REQUEST(TCGETS),
    REQUEST(TCSETS),
    REQUEST(TCSETSW),
    REQUEST(TCSETSF),
    REQUEST(TCFLSH),
    REQUEST(TIOCEXCL),
    REQUEST(TIOCNXCL),
};

// Injecting input into another terminal, and other requests that the daemon does not need.
const std::vector<Request> kOthers = {
    REQUEST(TIOCSTI),   REQUEST(TIOCLINUX),   REQUEST(TIOCSCTTY),  REQUEST(TIOCCONS),
    REQUEST(TIOCSETD),  REQUEST(VT_ACTIVATE), REQUEST(KDSETMODE),  REQUEST(I2C_SLAVE_FORCE),
    REQUEST(I2C_SMBUS), REQUEST(MEMUNLOCK),   REQUEST(MEMWRITEOOB)};

// Used by newer C libraries instead of TCGETS and TCSETS; their macros have no such structure here.
constexpr uint64_t kNewer[] = {_IOC(_IOC_READ, 'T', 0x2A, 44), _IOC(_IOC_WRITE, 'T', 0x2B, 44),
                               _IOC(_IOC_WRITE, 'T', 0x2C, 44), _IOC(_IOC_WRITE, 'T', 0x2D, 44)};

// Makes each request in a confined process without an open file; the errno shows whether it passed.
std::vector<int> errors_of(const std::vector<uint64_t> &numbers) {
    int ends[2];
    REQUIRE(pipe(ends) == 0);
    std::vector<int> errors(numbers.size(), 0);
    const size_t bytes = errors.size() * sizeof errors[0];
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        message text;
        if (confine_process(&text) != ERROR_OK) {
            _exit(2);
        }
        for (size_t i = 0; i < numbers.size(); i++) {
            errno = 0;
            syscall(SYS_ioctl, -1L, numbers[i], nullptr);
            errors[i] = errno;
        }
        _exit(write(ends[1], errors.data(), bytes) == static_cast<ssize_t>(bytes) ? 0 : 3);
    }
    ::close(ends[1]);
    const ssize_t got = read(ends[0], errors.data(), bytes);
    ::close(ends[0]);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    // 2: built without libseccomp, which this test requires.
    REQUIRE(status == 0);
    REQUIRE(got == static_cast<ssize_t>(bytes));
    return errors;
}

std::vector<uint64_t> numbers_of(const std::vector<Request> &requests) {
    std::vector<uint64_t> numbers;
    for (const Request &request : requests) {
        numbers.push_back(request.number);
    }
    return numbers;
}

}  // namespace

TEST_CASE("all requests of the backends reach the kernel") {
    const std::vector<int> errors = errors_of(numbers_of(kOurs));
    for (size_t i = 0; i < kOurs.size(); i++) {
        CAPTURE(kOurs[i].name);
        CHECK(errors[i] == EBADF);
    }
    for (const int error : errors_of({std::begin(kNewer), std::end(kNewer)})) {
        CHECK(error == EBADF);
    }
}

TEST_CASE("other requests are refused, including terminal input injection") {
    const std::vector<int> errors = errors_of(numbers_of(kOthers));
    for (size_t i = 0; i < kOthers.size(); i++) {
        CAPTURE(kOthers[i].name);
        CHECK(errors[i] == EPERM);
    }
}

TEST_CASE("bits that the kernel ignores do not bypass the filter") {
    if (sizeof(unsigned long) < sizeof(uint64_t)) {
        return;  // no such requests
    }
    std::vector<uint64_t> numbers;
    for (unsigned bit = 32; bit < 64; bit++) {
        numbers.push_back(uint64_t{TIOCSTI} | uint64_t{1} << bit);
    }
    for (const int error : errors_of(numbers)) {
        CHECK(error == EPERM);
    }
}
