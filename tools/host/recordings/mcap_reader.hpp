// SPDX-License-Identifier: Apache-2.0
/// An MCAP file of ROS 2, or of ROS 1 as "mcap convert" makes it. Source: https://mcap.dev/spec
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_READER_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_READER_HPP

#include "tools/host/recordings/recording_reader.hpp"

class mcap_reader final : public recording_reader {
  public:
    explicit mcap_reader(const std::string &path) : recording_reader(path, "mcap recover") {}

  protected:
    void open() override;
    bool find_message(recording_message *message) override;

  private:
    unsigned read_record();
    void learn(unsigned code);
    void unpack_chunk();
    uint64_t find_summary();

    std::map<uint16_t, std::string> types_;
    std::string record_;  // without its head
};

#endif
