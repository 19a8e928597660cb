// SPDX-License-Identifier: Apache-2.0
/// The instrument as the capture uses it: console commands of a running vergenced, and the user's
/// Enter and Ctrl-C.
#ifndef VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_INSTRUMENT_HPP
#define VERGENCE_TOOLS_HOST_CAPTURE_CAPTURE_INSTRUMENT_HPP

#include <memory>
#include <string>

struct remote;

class capture_instrument {
  public:
    capture_instrument();
    ~capture_instrument();
    capture_instrument(const capture_instrument &) = delete;
    capture_instrument &operator=(const capture_instrument &) = delete;

    /// Connects to `address` (null: the default socket) with the token of this file (null: the
    /// default). From here on Ctrl-C is taken. False with one sentence in `*error`.
    bool open(const char *address, const char *token, std::string *error);

    /// Runs a command; its result can be read until the next one. False with one sentence.
    bool run(const std::string &command, std::string *error);
    /// A member of the last result, "left.position"; false: it has none.
    bool number(const std::string &path, double *value) const;
    bool text(const std::string &path, std::string *value) const;
    /// The number in a setting, as 300 of "300 counts".
    bool setting(const std::string &key, double *value, std::string *error);
    bool setting_text(const std::string &key, std::string *value, std::string *error);

    /// Copies a session of the instrument into the directory `local`, which it creates.
    bool fetch(const std::string &name, const std::string &local, std::string *error);

    /// Removes a session of the instrument, also after Ctrl-C; failures are ignored.
    void discard(const std::string &name);

    bool interrupted();
    enum class answer { line, end, interrupted };
    /// Waits for a line on standard input.
    answer ask(std::string *line);

  private:
    std::unique_ptr<remote> remote_;
    const struct cJSON *result_ = nullptr;
};

#endif
