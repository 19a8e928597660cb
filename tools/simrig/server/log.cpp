// SPDX-License-Identifier: Apache-2.0
#include "tools/simrig/server/log.hpp"

#include <zlib.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

namespace simrig {

namespace {
constexpr uint32_t kLogMagic = 0x4C475253;  // "SRGL"
}

uint32_t sum_of(const Body &body) {
    return uint32_t(crc32(0, body.data(), uInt(body.size())));
}

void write_log(const std::string &path, const LogHead &head, const std::vector<LogEntry> &entries) {
    BodyWriter out;
    out.u32(kLogMagic);
    out.u16(SIMRIG_VERSION);
    out.u16(0);
    out.u64(head.seed);
    for (const std::string *text : {&head.rig, &head.scene}) {
        out.u32(uint32_t(text->size()));
        out.text(*text);
    }
    for (const LogEntry &entry : entries) {
        out.u16(entry.type);
        out.u16(entry.role);
        out.u32(entry.answer);
        out.u32(uint32_t(entry.body.size()));
        out.bytes(entry.body);
    }
    const Body bytes = out.take();
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char *>(bytes.data()), long(bytes.size()));
    file.close();
    if (!file) {
        throw std::runtime_error("cannot write " + path);
    }
}

std::vector<LogEntry> read_log(const std::string &path, LogHead &head) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw std::runtime_error("cannot read " + path);
    }
    const Body bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    std::vector<LogEntry> entries;
    try {
        BodyReader in(bytes);
        if (in.u32() != kLogMagic || in.u16() != SIMRIG_VERSION) {
            throw std::runtime_error(path + " is not a log of this version of simrig");
        }
        in.u16();
        head.seed = in.u64();
        for (std::string *text : {&head.rig, &head.scene}) {
            const Body name = in.bytes(in.u32());
            *text = std::string(name.begin(), name.end());
        }
        while (in.left() > 0) {
            LogEntry entry;
            entry.type = in.u16();
            entry.role = in.u16();
            entry.answer = in.u32();
            entry.body = in.bytes(in.u32());
            entries.push_back(std::move(entry));
        }
    } catch (const BodyTooShort &) {
        throw std::runtime_error(path + " ends in the middle of a request");
    }
    return entries;
}

void replay(Board &board, const std::vector<LogEntry> &entries) {
    for (size_t i = 0; i < entries.size(); i++) {
        const LogEntry &entry = entries[i];
        if (entry.type == 0) {
            board.release();
            continue;
        }
        std::optional<Body> answer = board.begin(entry.type, entry.body, simrig_role(entry.role));
        while (!answer) {
            answer = board.step(1e6);
        }
        if (sum_of(*answer) != entry.answer) {
            throw std::runtime_error("request " + std::to_string(i + 1) + " of " +
                                     std::to_string(entries.size()) +
                                     " is answered otherwise than it was in the log");
        }
    }
}

}  // namespace simrig
