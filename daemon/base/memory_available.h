// SPDX-License-Identifier: Apache-2.0
/// How much memory the system could give now without ending somebody for it.
#ifndef VERGENCE_DAEMON_BASE_MEMORY_AVAILABLE_H
#define VERGENCE_DAEMON_BASE_MEMORY_AVAILABLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// In bytes: what /proc/meminfo calls available, and free swap. Sources: proc(5), sysinfo(2).
uint64_t memory_available_bytes(void);

/// The same from a file that looks like /proc/meminfo. Where it cannot be read or does not say
/// (/proc of processes alone, kernels before 3.14): memory and swap that nobody uses, without the
/// files that are kept in memory only as long as there is room, so too little.
uint64_t memory_available_as_in(const char *meminfo);

#ifdef __cplusplus
}
#endif

#endif
