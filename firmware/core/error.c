// SPDX-License-Identifier: Apache-2.0
#include "core/error.h"

const char *error_text(int code) {
    switch (code) {
#define ERROR_CASE(name, number, text) \
    case ERROR_##name:                 \
        return text;
        ERROR_LIST(ERROR_CASE)
#undef ERROR_CASE
        default:
            return "unknown error";
    }
}

const char *error_name(int code) {
    switch (code) {
#define ERROR_CASE(name, number, text) \
    case ERROR_##name:                 \
        return #name;
        ERROR_LIST(ERROR_CASE)
#undef ERROR_CASE
        default:
            return "UNKNOWN";
    }
}
