// SPDX-License-Identifier: Apache-2.0
#include "bench/harness/bench_worker.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>

namespace {

constexpr const char *kPython = "/usr/bin/python3";

std::string setting_json(const opencv_setting &setting, const opencv_input &input) {
    // The speckle's step is in pixels for the semi-global modes, in 1/16 px for block matching.
    const int speckle_step = setting.mode == opencv_mode::block_matching ? 32 : 2;
    const std::pair<const char *, int> numbers[] = {
        {"min", input.disparity_min},
        {"count", input.disparity_count},
        {"block", setting.block_px},
        {"p1", setting.p1()},
        {"p2", setting.p2()},
        {"prefilter_cap", setting.prefilter_cap},
        {"uniqueness", setting.uniqueness_percent},
        {"speckle", setting.speckle_px},
        {"speckle_step", speckle_step},
    };
    std::string text = std::string("{\"mode\": \"") + opencv_mode_name(setting.mode) + '"';
    for (const auto &[name, value] : numbers) {
        text += std::string(", \"") + name + "\": " + std::to_string(value);
    }
    return text + "}";
}

std::string bytes_of(const cv::Mat &image) {
    return std::string(image.ptr<char>(), image.total());
}

class worker_method : public bench_method {
  public:
    worker_method(std::shared_ptr<opencv_worker> worker, int number, const opencv_setting &setting,
                  const opencv_input &input)
        : worker_(std::move(worker)), number_(std::to_string(number)), input_(input) {
        const cv::Size size = input_.left.size();
        worker_->ask("make " + number_ + " " + std::to_string(size.width) + " " +
                         std::to_string(size.height) + " " + setting_json(setting, input_),
                     bytes_of(input_.left) + bytes_of(input_.right));
    }
    worker_method(const worker_method &) = delete;
    worker_method &operator=(const worker_method &) = delete;
    ~worker_method() override {
        try {
            worker_->ask("drop " + number_);
        } catch (const std::exception &) {
            // The process has ended, and its matcher with it.
        }
    }

    std::size_t first_run_bytes() override { return std::stoull(worker_->ask("first " + number_)); }

    bench_time run(int threads) override {
        const std::string answer = worker_->ask("run " + number_ + " " + std::to_string(threads));
        bench_time time;
        if (std::sscanf(answer.c_str(), "%lf %lf", &time.wall_ms, &time.cpu_ms) != 2) {
            throw std::runtime_error("no times from OpenCV's process: " + answer);
        }
        return time;
    }

    std::vector<float> disparity_px() override {
        cv::Mat disparity_q4(input_.left.size(), CV_16S);
        worker_->ask("result " + number_);
        worker_->read(disparity_q4.data, disparity_q4.total() * disparity_q4.elemSize());
        return opencv_disparity_px(disparity_q4, input_);
    }

  private:
    std::shared_ptr<opencv_worker> worker_;
    std::string number_;
    opencv_input input_;
};

// In the new process between fork and exec: only async-signal-safe calls.
[[noreturn]] void become_python(int in, int out, const char *folder) {
    dup2(in, STDIN_FILENO);
    dup2(out, STDOUT_FILENO);
    // -s: no modules of the user; -B: writes no cache next to the script.
    execl(kPython, kPython, "-s", "-B", OPENCV_WORKER_SCRIPT, folder, static_cast<char *>(nullptr));
    _exit(127);
}

}  // namespace

std::shared_ptr<opencv_worker> opencv_worker::start(const std::string &folder,
                                                    std::string *message) {
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) != 0) {
        throw std::runtime_error("cannot open the pipe to OpenCV's process");
    }
    if (pipe2(from, O_CLOEXEC) != 0) {
        close(to[0]);
        close(to[1]);
        throw std::runtime_error("cannot open the pipe from OpenCV's process");
    }
    std::signal(SIGPIPE, SIG_IGN);  // a dead process causes a write error, not a signal
    const pid_t process = fork();
    if (process == 0) {
        become_python(to[0], from[1], folder.c_str());
    }
    close(to[0]);
    close(from[1]);
    std::shared_ptr<opencv_worker> worker(new opencv_worker);
    worker->process_ = process;
    worker->to_ = fdopen(to[1], "wb");
    worker->from_ = fdopen(from[0], "rb");
    try {
        worker->version_ = worker->answer();
    } catch (const std::exception &error) {
        *message = error.what();
        return nullptr;
    }
    return worker;
}

opencv_worker::~opencv_worker() {
    std::fclose(to_);  // closing its input ends it
    std::fclose(from_);
    if (process_ > 0) {
        waitpid(process_, nullptr, 0);
    }
}

std::unique_ptr<bench_method> opencv_worker::make(const bench_pair &pair,
                                                  const opencv_setting &setting, bool padded) {
    return std::make_unique<worker_method>(shared_from_this(), made_++, setting,
                                           opencv_input_of(pair, padded));
}

std::string opencv_worker::ask(const std::string &line, const std::string &bytes) {
    const std::string sent = line + "\n" + bytes;
    std::fwrite(sent.data(), 1, sent.size(), to_);
    std::fflush(to_);
    return answer();
}

std::string opencv_worker::answer() {
    std::string line;
    for (int c = std::fgetc(from_); c != '\n'; c = std::fgetc(from_)) {
        if (c == EOF) {
            throw std::runtime_error("OpenCV's process ended");
        }
        line += static_cast<char>(c);
    }
    if (line.rfind("ok ", 0) != 0) {
        throw std::runtime_error("OpenCV's process: " + line);
    }
    return line.substr(3);
}

void opencv_worker::read(void *bytes, std::size_t size) {
    if (std::fread(bytes, 1, size, from_) != size) {
        throw std::runtime_error("OpenCV's process ended within a result");
    }
}
