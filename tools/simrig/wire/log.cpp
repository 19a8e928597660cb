// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/wire/log.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "tools/simrig/wire/body.hpp"
#include "tools/simrig/wire/message.hpp"

namespace simrig {

namespace {

constexpr uint32_t kLogMagic = 0x4C475253;  // "SRGL"
constexpr uint16_t kLogVersion = 4;
constexpr size_t kLongestLog = size_t(1) << 30;

Body head_bytes(const LogHead &head) {
    BodyWriter out;
    out.u32(kLogMagic);
    out.u16(kLogVersion);
    out.u16(SIMRIG_VERSION);
    out.u64(head.seed);
    out.u32(head.begin_s);
    out.u32(head.rig_sum);
    out.u32(head.scene_sum);
    out.u8(head.every_clock ? 1 : 0);
    for (const std::string *text : {&head.rig, &head.scene}) {
        out.u32(uint32_t(text->size()));
        out.text(*text);
    }
    return out.take();
}

LogHead read_head(const std::string &name, BodyReader &in) {
    const bool is_log = in.left() >= 8 && in.u32() == kLogMagic;
    if (!is_log || in.u16() != kLogVersion || in.u16() != SIMRIG_VERSION) {
        throw std::runtime_error(name + " is not a log of this version of simrig");
    }
    LogHead head;
    head.seed = in.u64();
    head.begin_s = in.u32();
    head.rig_sum = in.u32();
    head.scene_sum = in.u32();
    const uint8_t every_clock = in.u8();
    if (every_clock > 1 || head.begin_s > kLatestBeginS) {
        throw std::runtime_error(name + " is damaged");
    }
    head.every_clock = every_clock == 1;
    for (std::string *text : {&head.rig, &head.scene}) {
        const Body bytes = in.bytes(in.u32());
        *text = std::string(bytes.begin(), bytes.end());
    }
    return head;
}

LogEntry read_entry(const std::string &name, BodyReader &in) {
    LogEntry entry;
    const uint8_t happened = in.u8();
    entry.happened = Happened(happened);
    entry.role = in.u8();
    entry.type = in.u16();
    entry.steps = in.u32();
    entry.answer = in.u32();
    entry.body = in.bytes(in.u32());
    if (happened < uint8_t(Happened::kAnswered) || happened > uint8_t(Happened::kReleased) ||
        entry.role > SIMRIG_ROLE_CONTROL) {
        throw std::runtime_error(name + " is damaged");
    }
    return entry;
}

}  // namespace

uint32_t sum_of(const Body &body) {
    return uint32_t(crc32(0, body.data(), uInt(body.size())));
}

LogFile::LogFile(const std::string &path, const LogHead &head) : path_(path) {
    file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file_ < 0) {
        throw std::runtime_error("cannot write " + path + ": " + std::strerror(errno));
    }
    write(head_bytes(head));
}

LogFile::~LogFile() {
    close(file_);
}

void LogFile::write(const Body &bytes) {
    size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t count = ::write(file_, bytes.data() + done, bytes.size() - done);
        if (count < 0 && errno != EINTR) {
            throw std::runtime_error("cannot write " + path_ + ": " + std::strerror(errno));
        }
        done += count > 0 ? size_t(count) : 0;
    }
    end_ += long(bytes.size());
}

void LogFile::add(const LogEntry &entry) {
    BodyWriter out;
    out.u8(uint8_t(entry.happened));
    out.u8(entry.role);
    out.u16(entry.type);
    out.u32(entry.steps);
    out.u32(entry.answer);
    out.u32(uint32_t(entry.body.size()));
    out.bytes(entry.body);
    write(out.take());
}

void LogFile::cut(long end) {
    if (ftruncate(file_, end) != 0 || lseek(file_, end, SEEK_SET) != end) {
        throw std::runtime_error("cannot truncate " + path_ + ": " + std::strerror(errno));
    }
    end_ = end;
}

Log parse_log(const std::string &name, const Body &bytes) {
    BodyReader in(bytes);
    Log log;
    try {
        log.head = read_head(name, in);
        while (in.left() > 0) {
            log.entries.push_back(read_entry(name, in));
        }
    } catch (const BodyTooShort &) {
        throw std::runtime_error(name + " ends within a request");
    }
    return log;
}

Log read_log(const std::string &path) {
    return parse_log(path, whole_file(path, kLongestLog));
}

}  // namespace simrig
