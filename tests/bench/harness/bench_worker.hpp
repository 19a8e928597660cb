// SPDX-License-Identifier: Apache-2.0
/// Another OpenCV than the linked one, in a separate Python process behind two pipes
/// (opencv_worker.py), so that its runs are part of the same interleaved rounds.
#ifndef VERGENCE_TESTS_BENCH_BENCH_WORKER_HPP
#define VERGENCE_TESTS_BENCH_BENCH_WORKER_HPP

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <string>

#include "bench/harness/bench_opencv.hpp"

class opencv_worker : public std::enable_shared_from_this<opencv_worker> {
  public:
    /// Starts the process with the module cv2 of `folder`. Returns NULL with the reason in
    /// `message` on failure.
    static std::shared_ptr<opencv_worker> start(const std::string &folder, std::string *message);

    opencv_worker(const opencv_worker &) = delete;
    opencv_worker &operator=(const opencv_worker &) = delete;
    /// Ends the process and waits for it.
    ~opencv_worker();

    /// Version of the OpenCV in the process, as "4.10.0".
    const std::string &version() const { return version_; }

    /// A matcher in the process. All its work throws when the process fails or dies.
    std::unique_ptr<bench_method> make(const bench_pair &pair, const opencv_setting &setting,
                                       bool padded);

    /// Sends a line, then `bytes` raw; reads the reply's line without its leading "ok ".
    std::string ask(const std::string &line, const std::string &bytes = "");

    /// Reads raw bytes that follow a reply.
    void read(void *bytes, std::size_t size);

  private:
    opencv_worker() = default;
    std::string answer();

    pid_t process_ = -1;
    FILE *to_ = nullptr, *from_ = nullptr;
    std::string version_;
    int made_ = 0;
};

#endif
