// SPDX-License-Identifier: Apache-2.0
/// A bag of ROS 1, also one that its recorder did not close: its last, incomplete record is left
/// out. Debian's library, librosbag-storage, takes 45.9 MB in 59 packages, with OpenSSL and GnuPG
/// at run time, for a format of six kinds of records. Source: https://wiki.ros.org/Bags/Format/2.0
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_BAG_READER_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_BAG_READER_HPP

#include "tools/host/recordings/little_endian.hpp"
#include "tools/host/recordings/recording_reader.hpp"

const std::string bag_magic = "#ROSBAG V2.0\n";

class bag_reader final : public recording_reader {
  public:
    explicit bag_reader(const std::string &path) : recording_reader(path, "rosbag reindex") {}

  protected:
    void open() override;
    bool find_message(recording_message *message) override;

  private:
    using fields = std::map<std::string, std::string>;

    fields parse(const std::string &header) const;
    const std::string &value(const fields &from, const char *name) const;
    template <class Number>
    Number number(const char *name) const;
    unsigned read_record();
    void learn();
    void unpack_chunk();
    bool find_record(recording_message *message);

    fields header_;  // of the last record
    std::string data_;
    uint64_t index_ = 0;  // 0: the bag was not closed
};

#endif
