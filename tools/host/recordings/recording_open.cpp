// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/recording_open.hpp"

#include "core/error.h"
#include "tools/host/recordings/bag_reader.hpp"
#include "tools/host/recordings/mcap_reader.hpp"
#include "tools/host/recordings/mcap_records.hpp"

std::unique_ptr<recording_reader> recording_open(const std::string &path) {
    std::string begin(mcap_magic.size() + bag_magic.size(), '\0');
    std::ifstream(path, std::ios::binary)
        .read(&begin[0], static_cast<std::streamsize>(begin.size()));
    const auto begins = [&](const std::string &magic) {
        return begin.compare(0, magic.size(), magic) == 0;
    };
    std::unique_ptr<recording_reader> reader;
    if (begins(mcap_magic)) {
        reader = std::make_unique<mcap_reader>(path);
    } else if (begins(bag_magic)) {
        reader = std::make_unique<bag_reader>(path);
    } else if (begins("SQLite format 3")) {
        throw import_failure{ERROR_UNSUPPORTED,
                             path +
                                 ": is a recording of ROS 2 in SQLite (convert its directory: "
                                 "rosbags-convert --src DIR --dst NEW --dst-storage mcap)"};
    } else {
        throw import_failure{ERROR_SYNTAX,
                             path +
                                 ": is neither an MCAP file nor a ROS bag of version 2.0 (an "
                                 "image or video with both views: --side-by-side)"};
    }
    reader->begin();
    return reader;
}
