// SPDX-License-Identifier: Apache-2.0
/// Writes an MCAP file of the profile ros2: chunks without compression, with their index, a summary
/// and checksums. Debian has no library for it. Source: https://mcap.dev/spec
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_WRITER_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_WRITER_HPP

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tools/host/recordings/little_endian.hpp"

struct ros_type;

class mcap_writer {
  public:
    /// `write` gets all bytes in order; false: it failed, and so does everything from then on.
    explicit mcap_writer(std::function<bool(const std::string &)> write);

    /// Adds a message to the current chunk. The first one of a topic states its type.
    void message(const std::string &topic, const ros_type &type, uint64_t time_ns,
                 const std::string &cdr);
    /// Ends the current chunk, which is then written. False: failed.
    bool end_chunk();
    /// Writes what comes after the last chunk. False: something failed.
    bool end();

  private:
    struct channel {
        uint16_t id, schema;
        uint32_t messages;
        record_writer index;  // of the current chunk: time and offset of each message
    };

    bool put(const std::string &bytes);
    channel &channel_of(const std::string &topic, const ros_type &type);

    std::function<bool(const std::string &)> write_;
    bool failed_ = false;
    uint64_t at_ = 0;
    uint32_t crc_ = 0;
    std::map<std::string, uint16_t> schemas_;
    std::map<std::string, channel> channels_;
    std::string schema_records_, channel_records_, chunk_indexes_, chunk_;
    uint64_t begin_ns_ = UINT64_MAX, end_ns_ = 0, chunk_begin_ns_ = 0, chunk_end_ns_ = 0;
    uint32_t chunks_ = 0;
    uint64_t messages_ = 0;
};

#endif
