// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/mcap_reader.hpp"

#include "core/crc.h"
#include "core/error.h"
#include "tools/host/convert/import.hpp"
#include "tools/host/recordings/mcap_records.hpp"
#ifdef VERGENCE_HAS_ZSTD
#include <zstd.h>
#endif

namespace {

constexpr uint64_t chunk_max_bytes = 1u << 30;
constexpr size_t head_bytes = 9, footer_bytes = head_bytes + 20;

/// The unpacked records of a chunk; empty: damaged.
std::string unpacked(const std::string &path, const std::string &compression, const char *data,
                     size_t bytes, size_t unpacked_bytes) {
    if (compression.empty()) {
        return bytes == unpacked_bytes ? std::string(data, bytes) : "";
    }
#ifdef VERGENCE_HAS_ZSTD
    if (compression == "zstd") {
        std::string out(unpacked_bytes, '\0');
        return ZSTD_decompress(&out[0], out.size(), data, bytes) == unpacked_bytes ? out : "";
    }
#endif
    throw import_failure{ERROR_UNSUPPORTED,
                         path + ": packed with " + compression +
                             ", which is not supported (rewrite it: mcap compress --compression "
                             "none)"};
}

}  // namespace

mcap_reader::mcap_reader(const std::string &path) : path_(path), stream_(path, std::ios::binary) {
    stream_.seekg(0, std::ios::end);
    if (!stream_) {
        throw import_failure{ERROR_ARGUMENT, path + ": cannot be read"};
    }
    length_ = static_cast<uint64_t>(stream_.tellg());
    stream_.seekg(0);
    std::string magic(mcap_magic.size(), '\0');
    if (!stream_.read(&magic[0], static_cast<std::streamsize>(magic.size())) ||
        magic != mcap_magic) {
        throw import_failure{
            ERROR_SYNTAX,
            path + ": is not an MCAP file (an image or video with both views: --side-by-side)"};
    }
    check_end();
    stream_.seekg(static_cast<std::streamoff>(magic.size()));
    const head header = read_head();
    if (header.code != MCAP_HEADER) {
        damaged("begins without a header");
    }
    read_content(header);
    data_begin_ = static_cast<uint64_t>(stream_.tellg());
    find_channels();
    rewind();
}

void mcap_reader::damaged(const std::string &what) const {
    throw import_failure{ERROR_SYNTAX, path_ + ": damaged: " + what};
}

void mcap_reader::read(char *to, size_t bytes) {
    if (!stream_.read(to, static_cast<std::streamsize>(bytes))) {
        damaged("ends within a record");
    }
}

mcap_reader::head mcap_reader::read_head() {
    char raw[head_bytes];
    read(raw, sizeof raw);
    byte_reader in(raw, sizeof raw);
    const unsigned code = in.u8();
    const uint64_t bytes = in.u64();
    const auto at = static_cast<uint64_t>(stream_.tellg());
    if (bytes > length_ - at) {
        damaged("a record is longer than the file");
    }
    return {code, bytes};
}

std::string mcap_reader::read_content(const head &record) {
    if (record.bytes > chunk_max_bytes) {
        damaged("a record of more than 1 GiB");
    }
    std::string content(record.bytes, '\0');
    read(&content[0], content.size());
    return content;
}

/// The footer and the magic at the end of the file.
void mcap_reader::check_end() {
    const size_t bytes = footer_bytes + mcap_magic.size();
    std::string end(bytes, '\0');
    const bool long_enough = length_ >= bytes + mcap_magic.size();
    if (long_enough) {
        stream_.seekg(static_cast<std::streamoff>(length_ - bytes));
        read(&end[0], bytes);
    }
    if (!long_enough || end.substr(footer_bytes) != mcap_magic || end[0] != MCAP_FOOTER) {
        throw import_failure{ERROR_SYNTAX, path_ +
                                               ": truncated (copy it again, or repair it with "
                                               "\"mcap recover\")"};
    }
    byte_reader in(end.data() + head_bytes, sizeof(uint64_t));
    summary_ = in.u64();
    if (summary_ > length_ - bytes) {
        damaged("its summary is outside of it");
    }
}

/// From the summary; without one, from all records.
void mcap_reader::find_channels() {
    if (summary_ != 0) {
        stream_.seekg(static_cast<std::streamoff>(summary_));
        for (head record = read_head(); record.code != MCAP_FOOTER; record = read_head()) {
            const std::string content = read_content(record);
            learn(record.code, byte_reader(content.data(), content.size()));
        }
    }
    mcap_message message;
    if (channels_.empty()) {
        rewind();
        while (next(&message)) {
        }
    }
}

void mcap_reader::rewind() {
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(data_begin_));
    chunk_.clear();
    chunk_at_ = 0;
    ended_ = false;
}

void mcap_reader::learn(unsigned code, byte_reader in) {
    try {
        if (code == MCAP_SCHEMA) {
            const uint16_t id = in.u16();
            types_[id] = in.text();
        } else if (code == MCAP_CHANNEL) {
            const uint16_t id = in.u16(), type = in.u16();
            const std::string topic = in.text();
            channels_[id] = {topic, types_[type], in.text()};
        }
    } catch (const bytes_ended &) {
        damaged("a topic ends too early");
    }
}

void mcap_reader::open_chunk(byte_reader in) {
    try {
        in.skip(2 * sizeof(uint64_t));
        const uint64_t bytes = in.u64();
        const uint32_t crc = in.u32();
        const std::string compression = in.text();
        const uint64_t packed = in.u64();
        if (bytes > chunk_max_bytes || packed > in.left()) {
            damaged("a chunk's size is wrong");
        }
        chunk_ = unpacked(path_, compression, in.take(packed), packed, bytes);
        chunk_at_ = 0;
        if (chunk_.size() != bytes ||
            (crc != 0 && crc_update(0, chunk_.data(), chunk_.size()) != crc)) {
            damaged("a chunk's checksum is wrong");
        }
    } catch (const bytes_ended &) {
        damaged("a chunk ends too early");
    }
}

/// The message that begins `single_`.
bool mcap_reader::take(mcap_message *message) {
    byte_reader in(single_.data(), single_.size());
    try {
        const auto channel = channels_.find(in.u16());
        in.skip(sizeof(uint32_t) + 2 * sizeof(uint64_t));
        if (channel == channels_.end()) {
            damaged("a message of an unknown topic");
        }
        *message = {&channel->second, single_.data() + single_.size() - in.left(), in.left()};
        return true;
    } catch (const bytes_ended &) {
        damaged("a message ends too early");
    }
}

bool mcap_reader::next(mcap_message *message) {
    while (!ended_) {
        unsigned code;
        if (chunk_at_ < chunk_.size()) {
            byte_reader in(chunk_.data() + chunk_at_, chunk_.size() - chunk_at_);
            try {
                code = in.u8();
                const uint64_t bytes = in.u64();
                single_.assign(in.take(bytes), bytes);
                chunk_at_ += head_bytes + bytes;
            } catch (const bytes_ended &) {
                damaged("a chunk ends within a record");
            }
        } else {
            const head record = read_head();
            code = record.code;
            single_ = read_content(record);
        }
        if (code == MCAP_MESSAGE) {
            return take(message);
        }
        if (code == MCAP_CHUNK) {
            const std::string packed = std::move(single_);
            open_chunk(byte_reader(packed.data(), packed.size()));
        }
        ended_ = code == MCAP_DATA_END || code == MCAP_FOOTER;
        learn(code, byte_reader(single_.data(), single_.size()));
    }
    return false;
}
