// SPDX-License-Identifier: Apache-2.0
/// Reads the messages of an MCAP file in the order in which they were written, one chunk in memory.
/// Nothing in it is trusted. Source: https://mcap.dev/spec
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_READER_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_READER_HPP

#include <cstdint>
#include <fstream>
#include <map>
#include <string>

#include "tools/host/recordings/little_endian.hpp"

struct mcap_channel {
    std::string topic, type;  // "sensor_msgs/msg/Image"
    std::string encoding;     // "cdr"
};

struct mcap_message {
    const mcap_channel *channel;
    const char *data;  // until the next call
    size_t bytes;
};

class mcap_reader {
  public:
    /// Opens a file and checks that it is whole. Throws import_failure, as the others do.
    explicit mcap_reader(const std::string &path);

    /// All channels of the file.
    const std::map<uint16_t, mcap_channel> &channels() const { return channels_; }

    /// The next message; false at the end.
    bool next(mcap_message *message);

    /// Back to the first message.
    void rewind();

  private:
    struct head {
        unsigned code;
        uint64_t bytes;
    };

    [[noreturn]] void damaged(const std::string &what) const;
    void read(char *to, size_t bytes);
    head read_head();
    std::string read_content(const head &record);
    void learn(unsigned code, byte_reader in);
    void open_chunk(byte_reader in);
    void check_end();
    void find_channels();
    bool take(mcap_message *message);

    std::string path_;
    std::ifstream stream_;
    uint64_t length_ = 0, data_begin_ = 0, summary_ = 0;
    std::map<uint16_t, std::string> types_;
    std::map<uint16_t, mcap_channel> channels_;
    std::string chunk_, single_;
    size_t chunk_at_ = 0;
    bool ended_ = false;
};

#endif
