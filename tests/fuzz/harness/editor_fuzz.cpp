// SPDX-License-Identifier: Apache-2.0
// For any input the terminal gets only printable characters and shows the editor's line and cursor,
// in a window that changes its width now and then.
#include <algorithm>
#include <string>

#include "console/line/editor.h"
#include "fuzz_check.hpp"

namespace {

// In the input this byte changes the width to the next byte.
constexpr std::uint8_t new_width = 0x1C;
constexpr size_t width_min = 16;

// A terminal that counts columns: one per character of any number of bytes.
struct Screen {
    size_t column = 0, columns = EDITOR_COLUMNS;

    void put(unsigned char c) {
        if (c == '\r') {
            column = 0;
        } else if (c == '\n') {
            column = 0;
        } else if (c != '\a') {
            FUZZ_CHECK(c >= ' ' && c != 0x7F && c != 0x1B);
            if ((c & 0xC0) != 0x80) {
                column++;
                // More would wrap; ^C may, as a new line follows anyway.
                FUZZ_CHECK(column < columns || (c == '^' || c == 'C'));
            }
        }
    }
};

void send(void *screen, const char *data, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        static_cast<Screen *>(screen)->put(static_cast<unsigned char>(data[i]));
    }
}

void complete(void *, const char *typed, char *words) {
    const bool first = std::string(typed).find(' ') == std::string::npos;
    const std::string list = first ? "status stop pan" : "left right both";
    std::copy(list.begin(), list.end() + 1, words);
}

size_t characters(const char *text, size_t from, size_t to) {
    size_t count = 0;
    for (size_t i = from; i < to; i++) {
        count += (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80;
    }
    return count;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    static editor typed;
    Screen screen;
    editor_init(&typed, send, complete, &screen, "> ");
    editor_begin(&typed);
    for (size_t i = 0; i < size; i++) {
        if (data[i] == new_width && size - i > 2) {
            typed.columns = screen.columns = width_min + data[i + 1];
            i += 2;
        }
        const editor_event event = editor_feed(&typed, static_cast<char>(data[i]));
        FUZZ_CHECK(typed.length < EDITOR_LINE_BYTES && typed.cursor <= typed.length);
        FUZZ_CHECK(typed.line[typed.length] == '\0');
        if (event != EDITOR_MORE) {
            editor_begin(&typed);
        }
        FUZZ_CHECK(typed.scrolled <= typed.cursor);
        const size_t seen = characters(typed.line, typed.scrolled, typed.cursor);
        FUZZ_CHECK(screen.column == 2 + seen);
    }
    return 0;
}
