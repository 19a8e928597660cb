// SPDX-License-Identifier: Apache-2.0
/// `vergence reconstruct --debug DIR`: pictures of the matcher's intermediate results, and a page
/// that explains them.
#ifndef VERGENCE_TOOLS_HOST_DEBUG_DEBUG_HPP
#define VERGENCE_TOOLS_HOST_DEBUG_DEBUG_HPP

#include <string>

#include "daemon/surface/reconstruct_program.h"
#include "tools/host/debug/debug_pictures.hpp"

/// Lets the program draw the matcher's stages.
void debug_offer(reconstruct_program *program);

/// debug.html: the pictures of --debug in order, with a sentence on what each shows and what to
/// look for. It refers to the pictures next to it and needs no network.

class debug_page {
  public:
    debug_page(const debug_look &look, const reconstruct_context &context);

    /// Appends a picture.
    void add(const debug_picture &picture);

    /// Writes the page. Returns as a `result_writer`'s function.
    int write(const char *path, message *message) const;

  private:
    std::string title_, lead_, body_, section_;
    double row_percent_;  // position of the slices' row, percent of the height
};

#endif
