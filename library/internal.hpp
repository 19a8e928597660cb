// SPDX-License-Identifier: Apache-2.0
/// What the files of libvergence share.
#ifndef VERGENCE_LIBRARY_INTERNAL_HPP
#define VERGENCE_LIBRARY_INTERNAL_HPP

#include <atomic>
#include <new>
#include <string>
#include <vector>

#include "core/error.h"
#include "library/vergence.h"
#include "stereo/geometry/calibration.h"

struct vergence_calibration {
    calibration value{};
    std::string text, format, path;  // `path`: as messages name it
    bool good = true;
    std::string verdict, json;
    std::vector<std::string> notes;
};

/// Sets the error, if the caller wants it, and returns `code`.
int library_fail(vergence_error *error, int code, const std::string &text);

/// Words of a command line for the parsers, which want `char **`: the first is the command.
class library_words {
  public:
    explicit library_words(const char *command) : words_{command} {}
    void add(const std::string &word) { words_.push_back(word); }
    /// All up to NULL; `options` NULL: none.
    void add(const char *const *options);
    int count() const { return static_cast<int>(words_.size()); }
    /// Valid until a word is added.
    char **values();

  private:
    std::vector<std::string> words_;
    std::vector<char *> values_;
};

/// The observer during a call, and the share of the work before each stage.
class library_watch {
  public:
    explicit library_watch(const vergence_observer *observer) : observer_(observer) {}
    void expect(const double *work, int stages);
    void show(int stage, const char *what, int done, int total) const;
    bool should_stop() const {
        return observer_ != nullptr && observer_->should_stop != nullptr &&
               observer_->should_stop(observer_->self) != 0;
    }

  private:
    const vergence_observer *observer_;
    std::vector<double> before_;  // the last: all
};

/// A calibration for the caller: completes text and path of `value`.
vergence_calibration *library_calibration(const calibration &value, const std::string &format,
                                          const std::string &path);

/// Runs `call`, which returns 0 or a code; no exception leaves the library.
template <class Call>
int library_guard(vergence_error *error, const Call &call) {
    try {
        return call();
    } catch (const std::bad_alloc &) {
        return library_fail(error, ERROR_MEMORY, "out of memory");
    } catch (const std::exception &failure) {
        return library_fail(error, ERROR_IO, failure.what());
    }
}

#endif
