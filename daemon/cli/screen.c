// SPDX-License-Identifier: Apache-2.0
#include "daemon/cli/screen.h"

#include <stdbool.h>
#include <sys/ioctl.h>

size_t screen_columns(int fd) {
    struct winsize size;
    const bool known = ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
    return known ? size.ws_col : SCREEN_COLUMNS;
}
