// SPDX-License-Identifier: Apache-2.0
/// How much memory the system could give now without ending somebody for it.
#ifndef VERGENCE_DAEMON_MEMORY_AVAILABLE_H
#define VERGENCE_DAEMON_MEMORY_AVAILABLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// In bytes: what /proc/meminfo calls available, and free swap. Where that is hidden (a hardened
/// service sees processes alone in /proc) three quarters of all memory. Sources: proc(5),
/// sysinfo(2).
uint64_t memory_available_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
