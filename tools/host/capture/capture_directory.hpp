// SPDX-License-Identifier: Apache-2.0
/// The directory of a capture, as far as it is not a session: whether it may be used, the hidden
/// directory in it where pairs arrive, and the drawing.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_DIRECTORY_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_DIRECTORY_HPP

#include <string>

class capture_directory {
  public:
    explicit capture_directory(std::string path) : path_(std::move(path)) {}
    ~capture_directory();
    capture_directory(const capture_directory &) = delete;
    capture_directory &operator=(const capture_directory &) = delete;

    /// Whether pairs may be put there: it is missing, empty, a session, or was left by a capture
    /// before its first pair. False with one sentence in `*error`. Changes nothing.
    bool check(std::string *error) const;
    /// Creates it if it is missing. False with one sentence.
    bool make(std::string *error);
    /// A new empty hidden directory for a pair, `incoming()`, in place of the one before, which
    /// vanishes with its files. False with one sentence.
    bool renew(std::string *error);
    const std::string &incoming() const { return incoming_; }
    /// Writes guide.svg. False with one sentence.
    bool draw(const std::string &svg, std::string *error);

  private:
    void drop();
    bool fail(std::string *error) const;

    std::string path_, incoming_;
    int directory_ = -1, lock_ = -1;
};

#endif
