// SPDX-License-Identifier: Apache-2.0
#ifndef VERGENCE_TOOLS_HOST_VIEW_VIEW_JPEG_HPP
#define VERGENCE_TOOLS_HOST_VIEW_VIEW_JPEG_HPP

struct view_picture;

/// Fills the picture's `jpeg` from its pixels. False: out of memory.
bool view_jpeg_make(view_picture *picture);

#endif
