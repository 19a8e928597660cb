// SPDX-License-Identifier: Apache-2.0
/// Where the live view gets its pictures, and what runs its commands: an instrument or a session.
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_SOURCE_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

/// Both cameras side by side.
struct view_picture {
    std::uint64_t number = 0;         ///< from 1; set when it is published
    std::uint64_t taken_us = 0;       ///< monotonic time at which it was here
    int width_px = 0, height_px = 0;  ///< of both halves together
    int channels = 0;                 ///< 1: grey; 3: red, green, blue
    std::vector<std::uint8_t> pixels;
    std::string calibration;   ///< text of the calibration of the halves; "": none
    std::string without;       ///< why there is none
    std::string facts = "{}";  ///< what else is known of it, a JSON object
    std::vector<std::uint8_t> jpeg;
    std::string error;  ///< there is no picture: what is wrong and what to do
};

/// Grey values of its left (0) or right half, by BT.601 as everywhere: `grey` has room for them.
template <class Value>
void view_picture_half(const view_picture &picture, int side, Value *grey) {
    const int width = picture.width_px / 2;
    const auto row_values = static_cast<std::size_t>(picture.width_px * picture.channels);
    for (int y = 0; y < picture.height_px; y++) {
        const std::uint8_t *from = picture.pixels.data() +
                                   static_cast<std::size_t>(y) * row_values +
                                   static_cast<std::size_t>(side * width * picture.channels);
        for (int x = 0; x < width; x++, from += picture.channels) {
            *grey++ = static_cast<Value>(
                picture.channels == 1 ? from[0]
                                      : (77 * from[0] + 150 * from[1] + 29 * from[2] + 128) >> 8);
        }
    }
}

class view_source {
  public:
    virtual ~view_source() = default;

    /// Fills the next picture, all but its number, time and JPEG; the calibration if it is cheap or
    /// `calibrated`, else neither that nor why there is none. False: there is no other one for
    /// now, or with an error in the picture. One thread.
    virtual bool next(view_picture *picture, bool calibrated) = 0;

    /// Runs a command; each line of its answer, JSON, goes to `show`, which returns false to cancel
    /// it. Any thread.
    virtual void run(const std::string &command,
                     const std::function<bool(const std::string &line)> &show) = 0;
    /// Cancels what runs.
    virtual void cancel() = 0;

    /// Copies a file or a session into the directory `local`; a session of this machine stays where
    /// it is. Returns its path, or "" with one sentence. Any thread.
    virtual std::string fetch(const std::string &name, const std::string &local,
                              std::string *error) = 0;

    /// Copies a file of this machine to the instrument under this name. False with one sentence.
    virtual bool send(const std::string &local, const std::string &name, std::string *error) = 0;

    virtual std::string name() const = 0;
    /// Whether there is an instrument, with commands of its own.
    virtual bool is_live() const = 0;
    /// Ends waits of all threads.
    virtual void stop() = 0;
};

/// An instrument at `address` ("": this user's vergenced, else the system's) with the token of this
/// file (null: the default one). Null with one sentence.
std::unique_ptr<view_source> view_instrument_open(const char *address, const char *token,
                                                  std::string *error);

/// The pairs of a recorded session. `calibration`: a file in place of the session's own; null:
/// none. Null with one sentence.
std::unique_ptr<view_source> view_session_open(const char *path, const char *calibration,
                                               std::string *error);

/// A failed command's answer, as the daemon writes it.
std::string view_failed(const std::string &name, const std::string &message);

#endif
