// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/bag_reader.hpp"

namespace {

enum bag_record {
    BAG_MESSAGE = 2,
    BAG_HEADER = 3,
    BAG_CHUNK = 5,
    BAG_CONNECTION = 7,
};

}  // namespace

bag_reader::fields bag_reader::parse(const std::string &header) const {
    fields parsed;
    byte_reader in(header.data(), header.size());
    while (in.left() > 0) {
        const std::string field = in.text();
        const size_t equals = field.find('=');
        if (equals == std::string::npos) {
            damaged("a field without a value");
        }
        parsed[field.substr(0, equals)] = field.substr(equals + 1);
    }
    return parsed;
}

const std::string &bag_reader::value(const fields &from, const char *name) const {
    const auto found = from.find(name);
    if (found == from.end()) {
        damaged(std::string("a record without ") + name);
    }
    return found->second;
}

/// A field of the last record's header.
template <class Number>
Number bag_reader::number(const char *name) const {
    const std::string &raw = value(header_, name);
    return byte_reader(raw.data(), raw.size()).number<Number>();
}

/// The code of the next record.
unsigned bag_reader::read_record() {
    const auto take_sized = [this] {
        const std::string length = take(sizeof(uint32_t));
        return take(byte_reader(length.data(), length.size()).u32());
    };
    header_ = parse(take_sized());
    data_ = take_sized();
    return number<uint8_t>("op");
}

/// Channels are taken from the index; without one, from all records.
void bag_reader::open() {
    seek(bag_magic.size());
    if (read_record() != BAG_HEADER) {
        damaged("begins without a header");
    }
    begin_data();
    index_ = number<uint64_t>("index_pos");
    if (index_ == 0) {
        recording_message message;
        while (find_message(&message)) {
        }
        return;
    }
    if (index_ > length()) {
        truncated();
    }
    // Connections, then what is in the chunks.
    uint64_t records = number<uint32_t>("conn_count");
    records += number<uint32_t>("chunk_count");
    seek(index_);
    for (uint64_t i = 0; i < records; i++) {
        if (read_record() == BAG_CONNECTION) {
            learn();
        }
    }
}

void bag_reader::learn() {
    add_channel(number<uint32_t>("conn"),
                {value(header_, "topic"), value(parse(data_), "type"), "ros1"});
}

void bag_reader::unpack_chunk() {
    const std::string &compression = value(header_, "compression");
    if (data_.empty() && compression != "none") {
        end();  // being written when the recorder ended: its length was to follow
        return;
    }
    const std::string packed = std::move(data_);
    open_chunk(compression, packed.data(), packed.size(), number<uint32_t>("size"));
}

bool bag_reader::find_record(recording_message *message) {
    while (begin_record()) {
        if (index_ != 0 && !within_chunk() && position() >= index_) {
            return false;
        }
        const unsigned code = read_record();
        if (code == BAG_MESSAGE) {
            *message = {channel(number<uint32_t>("conn")), data_.data(), data_.size()};
            return true;
        }
        if (code == BAG_CHUNK) {
            unpack_chunk();
        } else if (code == BAG_CONNECTION) {
            learn();
        }
    }
    return false;
}

bool bag_reader::find_message(recording_message *message) {
    try {
        return find_record(message);
    } catch (const recording_truncated &) {
        if (index_ != 0) {
            throw;
        }
        end();
        return false;
    }
}
