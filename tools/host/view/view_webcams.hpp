// SPDX-License-Identifier: Apache-2.0
/// A vergenced of one's own for two webcams: it is there as long as this object.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_WEBCAMS_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_WEBCAMS_HPP

#include <sys/types.h>

#include <string>

class view_webcams {
  public:
    view_webcams() = default;
    /// Ends it and removes its socket and folder; files and store stay.
    ~view_webcams();
    view_webcams(const view_webcams &) = delete;
    view_webcams &operator=(const view_webcams &) = delete;

    /// Starts `program` on the devices of the left and the right camera, with its files below
    /// `out`, and waits until it serves. False with one sentence, which has its last line.
    bool start(const std::string &program, const std::string &left, const std::string &right,
               const std::string &out, std::string *error);
    /// "unix:PATH" of its socket.
    const std::string &address() const { return address_; }
    /// "/dev/video0 and /dev/video2"; "": not started.
    const std::string &cameras() const { return cameras_; }

  private:
    pid_t child_ = -1;
    std::string folder_, address_, cameras_;
};

/// Runs a program without a terminal and returns its exit code; what it says goes to `*output`.
/// Negative: it cannot be run.
int view_run_program(const std::string *words, std::size_t count, std::string *output);

/// Path of a program beside this one, or in one of these folders relative to it; "": none.
std::string view_program(const char *const *places, std::size_t count);

#endif
