// SPDX-License-Identifier: Apache-2.0
#include "tools/host/view/view_webcams.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

constexpr int start_ms = 5000, step_ms = 20;

/// Starts a program whose standard error, and output too if wanted, go to the descriptor.
pid_t spawn(const std::vector<std::string> &words, int output_fd) {
    std::vector<char *> arguments;
    for (const std::string &word : words) {
        arguments.push_back(const_cast<char *>(word.c_str()));
    }
    arguments.push_back(nullptr);
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child == 0) {
        sigset_t none;
        sigemptyset(&none);
        sigprocmask(SIG_SETMASK, &none, nullptr);
        signal(SIGPIPE, SIG_DFL);
        // Ctrl-C at the terminal is for the view, which then ends it; so does the view's own death.
        setpgid(0, 0);
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        const int null_fd = open("/dev/null", O_RDWR | O_CLOEXEC);
        dup2(null_fd, STDIN_FILENO);
        dup2(output_fd >= 0 ? output_fd : null_fd, STDOUT_FILENO);
        dup2(output_fd >= 0 ? output_fd : null_fd, STDERR_FILENO);
        if (getppid() == parent) {
            execv(arguments[0], arguments.data());
        }
        _exit(127);
    }
    return child;
}

std::string last_line(const std::string &path) {
    std::string text(65536, '\0');
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    const ssize_t bytes = fd >= 0 ? read(fd, &text[0], text.size()) : 0;
    if (fd >= 0) {
        close(fd);
    }
    text.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
    while (!text.empty() && text.back() == '\n') {
        text.pop_back();
    }
    return text.substr(text.rfind('\n') + 1);
}

}  // namespace

bool view_webcams::start(const std::string &program, const std::string &left,
                         const std::string &right, const std::string &out, std::string *error) {
    char folder[] = "/tmp/vergence-view-XXXXXX";
    if (mkdtemp(folder) == nullptr) {
        *error = std::string("/tmp: ") + std::strerror(errno);
        return false;
    }
    folder_ = folder;
    cameras_ = left + " and " + right;
    address_ = "unix:" + folder_ + "/v.sock";
    const std::string log = folder_ + "/log";
    for (const char *name : {"/files", "/store"}) {
        if (mkdir((out + name).c_str(), 0777) != 0 && errno != EEXIST) {
            *error = out + name + ": " + std::strerror(errno);
            return false;
        }
    }
    // Its log is what it prints, from the first error in its settings on.
    const int log_fd = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    child_ = spawn({program, "--config", "/dev/null", "profile=two-cameras", "left_camera=" + left,
                    "right_camera=" + right, "socket=" + folder_ + "/v.sock",
                    "files=" + out + "/files", "store=" + out + "/store", "log=none"},
                   log_fd);
    if (log_fd >= 0) {
        close(log_fd);
    }
    if (child_ < 0) {
        *error = std::string("cannot start vergenced: ") + std::strerror(errno);
        return false;
    }
    for (int waited_ms = 0; waited_ms < start_ms; waited_ms += step_ms) {
        int status = 0;
        if (access((folder_ + "/v.sock").c_str(), F_OK) == 0) {
            return true;
        }
        if (waitpid(child_, &status, WNOHANG) == child_) {
            child_ = -1;
            *error = program + " ended: " + last_line(log);
            return false;
        }
        poll(nullptr, 0, step_ms);
    }
    *error = program + " does not answer: " + last_line(log);
    return false;
}

view_webcams::~view_webcams() {
    if (child_ > 0) {
        kill(child_, SIGTERM);
        waitpid(child_, nullptr, 0);
    }
    if (!folder_.empty()) {
        for (const char *name : {"/v.sock", "/log"}) {
            unlink((folder_ + name).c_str());
        }
        rmdir(folder_.c_str());
    }
}

int view_run_program(const std::string *words, std::size_t count, std::string *output) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        return -1;
    }
    const pid_t child = spawn(std::vector<std::string>(words, words + count), ends[1]);
    close(ends[1]);
    char block[4096];
    for (ssize_t bytes = 0; child > 0;) {
        bytes = read(ends[0], block, sizeof block);
        if (bytes > 0) {
            output->append(block, static_cast<std::size_t>(bytes));
        } else if (bytes == 0 || errno != EINTR) {
            break;
        }
    }
    close(ends[0]);
    int status = 0;
    return child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status)
               ? WEXITSTATUS(status)
               : -1;
}

std::string view_program(const char *const *places, std::size_t count) {
    char self[PATH_MAX];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    const std::string here(self, length > 0 ? static_cast<std::size_t>(length) : 0);
    const std::string folder = here.substr(0, here.rfind('/') + 1);
    if (count == 0) {
        return here;
    }
    for (std::size_t i = 0; i < count; i++) {
        const std::string path = folder + places[i];
        if (!folder.empty() && access(path.c_str(), X_OK) == 0) {
            return path;
        }
    }
    return "";
}
