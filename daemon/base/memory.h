// SPDX-License-Identifier: Apache-2.0
/// How much memory there is.
#ifndef VERGENCE_DAEMON_BASE_MEMORY_H
#define VERGENCE_DAEMON_BASE_MEMORY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Memory that the system can provide without killing a process for it, in bytes: MemAvailable of
/// /proc/meminfo plus free swap, and no more than what is left of CommitLimit if the system
/// promises no more memory than it has (vm.overcommit_memory = 2). VERGENCE_MEMINFO names another
/// file, for tests. Sources: proc(5), sysinfo(2).
uint64_t memory_available_bytes(void);

/// The same from files in the formats of /proc/meminfo and /proc/sys/vm/overcommit_memory. If the
/// first cannot be read or has no such line (/proc with processes only, kernels before 3.14): free
/// memory and swap without the page cache, which is an underestimate.
uint64_t memory_available_as_in(const char *meminfo, const char *overcommit);

/// Resident memory of this process, and its peak, in bytes: VmRSS and VmHWM of /proc/self/status.
/// 0: not known.
struct memory_used {
    uint64_t bytes, peak_bytes;
};
struct memory_used memory_used_now(void);

/// From here on a freed block of 256 KiB or more, such as a frame, goes back to the system at once.
/// The GNU C library would keep all of them for later ones, once one was freed.
void memory_return_freed(void);

#ifdef __cplusplus
}
#endif

#endif
