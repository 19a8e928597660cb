// SPDX-License-Identifier: Apache-2.0
/// All image formats that the host reads, in one list.
#ifndef VERGENCE_TOOLS_HOST_FORMATS_IMAGE_FORMATS_HPP
#define VERGENCE_TOOLS_HOST_FORMATS_IMAGE_FORMATS_HPP

#include "daemon/images/image_file.h"

struct image_format_list {
    const image_format *first;
    int count;
};

/// Static storage.
image_format_list image_formats();

#endif
