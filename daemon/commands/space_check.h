// SPDX-License-Identifier: Apache-2.0
/// Checks of commands that need memory or write files, before they begin.
#ifndef VERGENCE_DAEMON_COMMANDS_SPACE_CHECK_H
#define VERGENCE_DAEMON_COMMANDS_SPACE_CHECK_H

#include "console/command.h"
#include "daemon/files/free_space.h"
#include "daemon/server/daemon.h"
#include "rig/pair.h"

/// What is there now for the daemon's commands. Any thread.
struct free_space space_check_now(const struct daemon *daemon);

/// 0; or ERROR_MEMORY or ERROR_FULL with the call's message: what is needed, what is there, and
/// `advice` (NULL: none).
int space_check(const struct command_call *call, const struct free_space *need, const char *advice);

/// The layout of frames; if it is not known, that of which they take most memory.
enum raw_layout space_check_layout(const struct daemon *daemon);

/// What frames need: images in memory and in files, and bytes that do not depend on their size.
struct free_space_frames {
    double memory_images, files_images;
    struct free_space fixed;
};

/// The same for frames of the present window; the advice is the largest window that fits. The rig's
/// thread only.
int space_check_frames(const struct command_call *call, const struct free_space_frames *frames);

/// The same for a pair, to be kept in memory and, if `named` or in a recording, written. The last
/// pair is forgotten if there is no room beside it.
int space_check_pair(const struct command_call *call, const struct pair_options *options,
                     bool named);

/// The same for a recording with a few commands. Its frames are checked as they come.
int space_check_recording(const struct command_call *call);

/// Images of memory that a frame of each camera takes for `view`, for which the stream restarts
/// behind the bridge. There they have the size of the window only if `whole`.
unsigned space_check_look_images(const struct command_call *call, bool whole);

#endif
