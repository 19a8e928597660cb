// SPDX-License-Identifier: Apache-2.0
/// Messages of a recording of ROS in the order in which they were written, one chunk in memory.
/// Nothing in it is trusted. All functions throw import_failure.
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_READER_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_RECORDING_READER_HPP

#include <cstdint>
#include <fstream>
#include <map>
#include <string>

#include "tools/host/convert/import.hpp"

struct recording_channel {
    std::string topic, type;  // "sensor_msgs/msg/Image", also of ROS 1
    std::string encoding;     // "cdr", "ros1"
};

struct recording_message {
    const recording_channel *channel;
    const char *data;  // until the next call
    size_t bytes;
};

/// The file ends before its contents do.
struct recording_truncated : import_failure {};

class recording_reader {
  public:
    virtual ~recording_reader() = default;

    /// Learns the channels; before all else.
    void begin();

    /// All channels of the file.
    const std::map<uint32_t, recording_channel> &channels() const { return channels_; }

    /// The next message; false at the end.
    bool next(recording_message *message);

    /// Back to the first message.
    void rewind();

  protected:
    /// `repair`: what mends a truncated file.
    recording_reader(std::string path, std::string repair);

    /// Learns the channels, and calls `begin_data` before the first record of the data.
    virtual void open() = 0;
    virtual bool find_message(recording_message *message) = 0;

    [[noreturn]] void damaged(const std::string &what) const;
    [[noreturn]] void truncated() const;
    void begin_data() { data_begin_ = position(); }
    void end() { ended_ = true; }
    uint64_t length() const { return length_; }
    uint64_t position() { return static_cast<uint64_t>(stream_.tellg()); }
    void seek(uint64_t at);

    /// Ends the last record. False: so does the data.
    bool begin_record();
    bool within_chunk() const { return !chunk_.empty(); }
    /// The next bytes of the current record, of the open chunk or of the file.
    std::string take(uint64_t bytes);
    /// The next records are those of a chunk.
    const std::string &open_chunk(const std::string &compression, const char *packed,
                                  size_t packed_bytes, uint64_t bytes);
    void add_channel(uint32_t id, recording_channel channel);
    const recording_channel *channel(uint32_t id) const;

  private:
    template <class Work>
    auto checked(Work work);

    std::string path_, repair_;
    std::ifstream stream_;
    uint64_t length_ = 0, data_begin_ = 0;
    std::map<uint32_t, recording_channel> channels_;
    std::string chunk_;
    size_t chunk_at_ = 0;
    bool ended_ = false;
};

#endif
