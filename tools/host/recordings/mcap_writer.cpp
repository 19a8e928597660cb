// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/mcap_writer.hpp"

#include <algorithm>

#include "core/crc.h"
#include "tools/host/recordings/mcap_records.hpp"
#include "tools/host/recordings/ros_messages.hpp"

namespace {

std::string record(unsigned code, const std::string &content) {
    record_writer head;
    head.u8(code);
    head.u64(content.size());
    return head.bytes + content;
}

}  // namespace

mcap_writer::mcap_writer(std::function<bool(const std::string &)> write)
    : write_(std::move(write)) {
    record_writer header;
    header.sized("ros2");
    header.sized("vergence");
    put(mcap_magic);
    put(record(MCAP_HEADER, header.bytes));
}

bool mcap_writer::put(const std::string &bytes) {
    failed_ = failed_ || !write_(bytes);
    at_ += bytes.size();
    crc_ = crc_update(crc_, bytes.data(), bytes.size());
    return !failed_;
}

mcap_writer::channel &mcap_writer::channel_of(const std::string &topic, const ros_type &type) {
    const auto known = channels_.find(topic);
    if (known != channels_.end()) {
        return known->second;
    }
    const auto schema = schemas_.emplace(type.name, schemas_.size() + 1);
    if (schema.second) {
        record_writer text;
        text.u16(schema.first->second);
        text.sized(type.name);
        text.sized("ros2msg");
        text.sized(ros_definition(type));
        schema_records_ += record(MCAP_SCHEMA, text.bytes);
        chunk_ += record(MCAP_SCHEMA, text.bytes);
    }
    channel made{static_cast<uint16_t>(channels_.size() + 1), schema.first->second, 0, {}};
    record_writer text;
    text.u16(made.id);
    text.u16(made.schema);
    text.sized(topic);
    text.sized("cdr");
    text.sized("");  // no metadata
    channel_records_ += record(MCAP_CHANNEL, text.bytes);
    chunk_ += record(MCAP_CHANNEL, text.bytes);
    return channels_.emplace(topic, std::move(made)).first->second;
}

void mcap_writer::message(const std::string &topic, const ros_type &type, uint64_t time_ns,
                          const std::string &cdr) {
    channel &to = channel_of(topic, type);
    chunk_begin_ns_ = chunk_end_ns_ == 0 ? time_ns : std::min(chunk_begin_ns_, time_ns);
    chunk_end_ns_ = std::max(chunk_end_ns_, time_ns);
    to.index.u64(time_ns);
    to.index.u64(chunk_.size());
    record_writer head;
    head.u16(to.id);
    head.u32(to.messages++);
    head.u64(time_ns);
    head.u64(time_ns);
    record_writer length;
    length.u8(MCAP_MESSAGE);
    length.u64(head.bytes.size() + cdr.size());
    chunk_ += length.bytes + head.bytes;
    chunk_ += cdr;
    messages_++;
}

bool mcap_writer::end_chunk() {
    if (chunk_.empty()) {
        return !failed_;
    }
    const uint64_t begin = at_;
    record_writer head;
    head.u64(chunk_begin_ns_);
    head.u64(chunk_end_ns_);
    head.u64(chunk_.size());
    head.u32(crc_update(0, chunk_.data(), chunk_.size()));
    head.sized("");  // not compressed
    head.u64(chunk_.size());
    record_writer code;
    code.u8(MCAP_CHUNK);
    code.u64(head.bytes.size() + chunk_.size());
    put(code.bytes + head.bytes);
    put(chunk_);
    const uint64_t length = at_ - begin;
    record_writer offsets;
    for (auto &each : channels_) {
        channel &one = each.second;
        if (!one.index.bytes.empty()) {
            offsets.u16(one.id);
            offsets.u64(at_);
            record_writer index;
            index.u16(one.id);
            index.sized(one.index.bytes);
            put(record(MCAP_MESSAGE_INDEX, index.bytes));
            one.index.bytes.clear();
        }
    }
    record_writer index;
    index.u64(chunk_begin_ns_);
    index.u64(chunk_end_ns_);
    index.u64(begin);
    index.u64(length);
    index.sized(offsets.bytes);
    index.u64(at_ - begin - length);
    index.sized("");
    index.u64(chunk_.size());
    index.u64(chunk_.size());
    chunk_indexes_ += record(MCAP_CHUNK_INDEX, index.bytes);
    begin_ns_ = std::min(begin_ns_, chunk_begin_ns_);
    end_ns_ = std::max(end_ns_, chunk_end_ns_);
    chunk_end_ns_ = 0;
    chunk_.clear();
    chunks_++;
    return !failed_;
}

bool mcap_writer::end() {
    end_chunk();
    record_writer end;
    end.u32(crc_);
    put(record(MCAP_DATA_END, end.bytes));
    record_writer statistics, counts;
    for (const auto &each : channels_) {
        counts.u16(each.second.id);
        counts.u64(each.second.messages);
    }
    statistics.u64(messages_);
    statistics.u16(static_cast<unsigned>(schemas_.size()));
    statistics.u32(channels_.size());
    statistics.u32(0);  // attachments
    statistics.u32(0);  // metadata
    statistics.u32(chunks_);
    statistics.u64(messages_ > 0 ? begin_ns_ : 0);
    statistics.u64(end_ns_);
    statistics.sized(counts.bytes);
    const uint64_t summary = at_;
    crc_ = 0;
    put(schema_records_);
    put(channel_records_);
    put(chunk_indexes_);
    put(record(MCAP_STATISTICS, statistics.bytes));
    record_writer footer;
    footer.u8(MCAP_FOOTER);
    footer.u64(20);
    footer.u64(summary);
    footer.u64(0);  // no offsets of the summary's groups
    put(footer.bytes);
    record_writer check;
    check.u32(crc_);
    put(check.bytes);
    return put(mcap_magic);
}
