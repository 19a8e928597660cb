// SPDX-License-Identifier: Apache-2.0
#include "daemon/files/file_error.h"

#include <errno.h>

#include "core/error.h"

bool file_error_is_full(int number) {
    return number == ENOSPC || number == EDQUOT || number == EFBIG;
}

int file_error(int number) {
    switch (number) {
        case ENOENT:
        case ENOTDIR:
            return ERROR_MISSING;
        case EACCES:
        case EPERM:
        case EROFS:
        case ELOOP:
            return ERROR_REFUSED;
        default:
            return file_error_is_full(number) ? ERROR_FULL : ERROR_IO;
    }
}
