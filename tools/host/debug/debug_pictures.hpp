// SPDX-License-Identifier: Apache-2.0
/// The pictures of --debug: which ones exist, what they show and what they look like.
#ifndef VERGENCE_TOOLS_HOST_DEBUG_DEBUG_PICTURES_HPP
#define VERGENCE_TOOLS_HOST_DEBUG_DEBUG_PICTURES_HPP

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/surface/result/reconstruct_context.h"
#include "tools/host/debug/debug_look.hpp"
#include "tools/host/formats/colormap.hpp"
#include "tools/host/page/page.hpp"

/// Index of a pixel without data; its colour is the same in all pictures.
constexpr int debug_nothing = 255;

struct debug_picture {
    const char *file_name;
    const char *section;  // section of the page
    std::string title, shows, look_for;
    int width_px, height_px;
    std::vector<std::uint8_t> indices;
    colormap_table palette;
    // The scale: values at the first and the last index, or one colour per meaning.
    std::string low, high;
    int last_index;
    std::vector<page_key> keys;
    // As high as the left image, or as a level of it: the row of the slices is marked.
    bool has_row;
};

/// Draws what was recorded of the run, one picture after the other; stops at the first `emit` that
/// returns an error, and returns it.
int debug_pictures_draw(const debug_look &look, const reconstruct_context &context,
                        const std::function<int(const debug_picture &)> &emit);

/// Names of all possible pictures, in the order of the page.
const std::vector<const char *> &debug_pictures_names();

#endif
