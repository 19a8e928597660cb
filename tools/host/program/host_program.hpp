// SPDX-License-Identifier: Apache-2.0
/// What a PC reads and writes of a reconstruction: of the program `vergence` and of libvergence.
#ifndef VERGENCE_TOOLS_HOST_PROGRAM_HOST_PROGRAM_HPP
#define VERGENCE_TOOLS_HOST_PROGRAM_HOST_PROGRAM_HPP

#include "daemon/surface/reconstruct_program.h"

/// All formats of images and calibrations, all result files, --debug; no `target`.
reconstruct_program host_program();

#endif
