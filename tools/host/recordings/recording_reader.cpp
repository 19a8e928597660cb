// SPDX-License-Identifier: Apache-2.0
#include "tools/host/recordings/recording_reader.hpp"

#include <utility>

#include "core/error.h"
#include "tools/host/recordings/little_endian.hpp"
#ifdef VERGENCE_HAS_BZ2
#include <bzlib.h>
#endif
#ifdef VERGENCE_HAS_LZ4
#include <lz4frame.h>
#endif
#ifdef VERGENCE_HAS_ZSTD
#include <zstd.h>
#endif

namespace {

constexpr uint64_t record_max_bytes = 1u << 30;

/// Unpacks a whole chunk. False: it is damaged, or not of this size.
using unpacker = bool (*)(const char *packed, size_t packed_bytes, std::string *out);

#ifdef VERGENCE_HAS_BZ2
bool unpack_bz2(const char *packed, size_t packed_bytes, std::string *out) {
    auto bytes = static_cast<unsigned>(out->size());
    return BZ2_bzBuffToBuffDecompress(&(*out)[0], &bytes, const_cast<char *>(packed),
                                      static_cast<unsigned>(packed_bytes), 0, 0) == BZ_OK &&
           bytes == out->size();
}
#endif

#ifdef VERGENCE_HAS_LZ4
bool unpack_lz4(const char *packed, size_t packed_bytes, std::string *out) {
    LZ4F_dctx *context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) {
        throw std::bad_alloc();
    }
    size_t bytes = out->size();
    const size_t left =
        LZ4F_decompress(context, &(*out)[0], &bytes, packed, &packed_bytes, nullptr);
    LZ4F_freeDecompressionContext(context);
    return left == 0 && bytes == out->size();
}
#endif

#ifdef VERGENCE_HAS_ZSTD
bool unpack_zstd(const char *packed, size_t packed_bytes, std::string *out) {
    return ZSTD_decompress(&(*out)[0], out->size(), packed, packed_bytes) == out->size();
}
#endif

/// How to unpack what this build can; without a function: stored.
const std::map<std::string, unpacker> unpackers = {
    {"", nullptr},         {"none", nullptr},
#ifdef VERGENCE_HAS_BZ2
    {"bz2", unpack_bz2},
#endif
#ifdef VERGENCE_HAS_LZ4
    {"lz4", unpack_lz4},
#endif
#ifdef VERGENCE_HAS_ZSTD
    {"zstd", unpack_zstd},
#endif
};

}  // namespace

recording_reader::recording_reader(std::string path, std::string repair)
    : path_(std::move(path)), repair_(std::move(repair)), stream_(path_, std::ios::binary) {
    stream_.seekg(0, std::ios::end);
    length_ = position();
    seek(0);
}

template <class Work>
auto recording_reader::checked(Work work) {
    try {
        return work();
    } catch (const bytes_ended &) {
        damaged("a record ends too early");
    }
}

void recording_reader::begin() {
    checked([&] { open(); });
    rewind();
}

bool recording_reader::next(recording_message *message) {
    return checked([&] { return find_message(message); });
}

void recording_reader::rewind() {
    seek(data_begin_);
    chunk_.clear();
    chunk_at_ = 0;
    ended_ = false;
}

void recording_reader::damaged(const std::string &what) const {
    throw import_failure{ERROR_SYNTAX, path_ + ": damaged: " + what};
}

void recording_reader::truncated() const {
    throw recording_truncated{
        {ERROR_SYNTAX,
         path_ + ": truncated (copy it again, or repair it with \"" + repair_ + "\")"}};
}

void recording_reader::seek(uint64_t at) {
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(at));
    if (!stream_) {
        throw import_failure{ERROR_ARGUMENT, path_ + ": cannot be read"};
    }
}

bool recording_reader::begin_record() {
    if (chunk_at_ == chunk_.size()) {
        chunk_.clear();
        chunk_at_ = 0;
    }
    return !ended_;
}

std::string recording_reader::take(uint64_t bytes) {
    if (within_chunk()) {
        if (bytes > chunk_.size() - chunk_at_) {
            damaged("a chunk ends within a record");
        }
        chunk_at_ += bytes;
        return chunk_.substr(chunk_at_ - bytes, bytes);
    }
    if (bytes > length_ - position()) {
        truncated();
    }
    if (bytes > record_max_bytes) {
        damaged("a record of more than 1 GiB");
    }
    std::string content(bytes, '\0');
    if (!stream_.read(&content[0], static_cast<std::streamsize>(bytes))) {
        throw import_failure{ERROR_IO, path_ + ": cannot be read"};
    }
    return content;
}

const std::string &recording_reader::open_chunk(const std::string &compression, const char *packed,
                                                size_t packed_bytes, uint64_t bytes) {
    // An archive that contains itself would never end.
    if (within_chunk()) {
        damaged("a chunk within a chunk");
    }
    const auto how = unpackers.find(compression);
    if (how == unpackers.end()) {
        throw import_failure{ERROR_UNSUPPORTED,
                             path_ + ": packed with " + compression +
                                 ", which is not supported (unpack it with \"mcap decompress\" or "
                                 "\"rosbag decompress\")"};
    }
    if (bytes > record_max_bytes) {
        damaged("a chunk of more than 1 GiB");
    }
    if (how->second == nullptr) {
        chunk_.assign(packed, packed_bytes);
    } else {
        chunk_.assign(bytes, '\0');
        if (!how->second(packed, packed_bytes, &chunk_)) {
            damaged("a chunk cannot be unpacked");
        }
    }
    chunk_at_ = 0;
    if (chunk_.size() != bytes) {
        damaged("a chunk's size is wrong");
    }
    return chunk_;
}

void recording_reader::add_channel(uint32_t id, recording_channel channel) {
    const size_t slash = channel.type.find('/');
    if (channel.encoding == "ros1" && slash != std::string::npos) {
        channel.type.insert(slash, "/msg");
    }
    channels_[id] = std::move(channel);
}

const recording_channel *recording_reader::channel(uint32_t id) const {
    const auto found = channels_.find(id);
    if (found == channels_.end()) {
        damaged("a message of an unknown topic");
    }
    return &found->second;
}
