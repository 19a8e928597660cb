// SPDX-License-Identifier: Apache-2.0
#ifndef SIMRIG_STREAMS_HPP
#define SIMRIG_STREAMS_HPP

#include <fcntl.h>

/// Opens those of the standard streams that are closed, so that no file or connection gets their
/// numbers and with them what is printed. False: it cannot be done.
inline bool occupy_standard_streams() {
    for (int fd = 0; fd <= 2; fd++) {
        if (fcntl(fd, F_GETFD) == -1 && open("/dev/null", O_RDWR) != fd) {
            return false;
        }
    }
    return true;
}

#endif
