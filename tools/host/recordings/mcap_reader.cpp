// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/mcap_reader.hpp"

#include "core/crc.h"
#include "tools/host/recordings/little_endian.hpp"
#include "tools/host/recordings/mcap_records.hpp"

namespace {

constexpr size_t head_bytes = 9, footer_bytes = head_bytes + 20;

}  // namespace

/// The code of the next record.
unsigned mcap_reader::read_record() {
    const std::string head = take(head_bytes);
    byte_reader in(head.data(), head.size());
    const unsigned code = in.u8();
    record_ = take(in.u64());
    return code;
}

/// Where the summary is, from the footer and the magic at the end of the file; 0: there is none.
uint64_t mcap_reader::find_summary() {
    const size_t bytes = footer_bytes + mcap_magic.size();
    if (length() < bytes + mcap_magic.size()) {
        truncated();
    }
    seek(length() - bytes);
    const std::string end = take(bytes);
    if (end.substr(footer_bytes) != mcap_magic || end[0] != MCAP_FOOTER) {
        truncated();
    }
    byte_reader in(end.data() + head_bytes, sizeof(uint64_t));
    const uint64_t summary = in.u64();
    if (summary > length() - bytes) {
        damaged("its summary is outside of it");
    }
    return summary;
}

/// Channels are taken from the summary; without one, from all records.
void mcap_reader::open() {
    const uint64_t summary = find_summary();
    seek(mcap_magic.size());
    if (read_record() != MCAP_HEADER) {
        damaged("begins without a header");
    }
    begin_data();
    if (summary != 0) {
        seek(summary);
        for (unsigned code = read_record(); code != MCAP_FOOTER; code = read_record()) {
            learn(code);
        }
    }
    recording_message message;
    if (channels().empty()) {
        rewind();
        while (find_message(&message)) {
        }
    }
}

void mcap_reader::learn(unsigned code) {
    byte_reader in(record_.data(), record_.size());
    if (code == MCAP_SCHEMA) {
        const uint16_t id = in.u16();
        types_[id] = in.text();
    } else if (code == MCAP_CHANNEL) {
        const uint16_t id = in.u16(), type = in.u16();
        const std::string topic = in.text();
        add_channel(id, {topic, types_[type], in.text()});
    }
}

void mcap_reader::unpack_chunk() {
    byte_reader in(record_.data(), record_.size());
    in.skip(2 * sizeof(uint64_t));
    const uint64_t bytes = in.u64();
    const uint32_t crc = in.u32();
    const std::string compression = in.text();
    const uint64_t packed_bytes = in.u64();
    const std::string &chunk = open_chunk(compression, in.take(packed_bytes), packed_bytes, bytes);
    if (crc != 0 && crc_update(0, chunk.data(), chunk.size()) != crc) {
        damaged("a chunk's checksum is wrong");
    }
}

bool mcap_reader::find_message(recording_message *message) {
    while (begin_record()) {
        const unsigned code = read_record();
        if (code == MCAP_MESSAGE) {
            byte_reader in(record_.data(), record_.size());
            const uint16_t id = in.u16();
            in.skip(sizeof(uint32_t) + 2 * sizeof(uint64_t));
            *message = {channel(id), record_.data() + record_.size() - in.left(), in.left()};
            return true;
        }
        if (code == MCAP_CHUNK) {
            unpack_chunk();
        } else if (code == MCAP_DATA_END || code == MCAP_FOOTER) {
            end();
        } else {
            learn(code);
        }
    }
    return false;
}
