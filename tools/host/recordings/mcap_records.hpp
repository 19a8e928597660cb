// SPDX-License-Identifier: Apache-2.0
/// Codes of MCAP's records. Source: https://mcap.dev/spec
#ifndef VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_RECORDS_HPP
#define VERGENCE_TOOLS_HOST_RECORDINGS_MCAP_RECORDS_HPP

#include <string>

enum mcap_record {
    MCAP_HEADER = 1,
    MCAP_FOOTER = 2,
    MCAP_SCHEMA = 3,
    MCAP_CHANNEL = 4,
    MCAP_MESSAGE = 5,
    MCAP_CHUNK = 6,
    MCAP_MESSAGE_INDEX = 7,
    MCAP_CHUNK_INDEX = 8,
    MCAP_STATISTICS = 11,
    MCAP_DATA_END = 15,
};

const std::string mcap_magic("\x89MCAP0\r\n", 8);

#endif
