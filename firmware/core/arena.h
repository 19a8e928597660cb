// SPDX-License-Identifier: Apache-2.0
/// Working memory provided by the caller, allocated from the bottom up and released all at once or
/// down to a mark. Its peak is recorded, which shows how much memory a job needs.
#ifndef VERGENCE_CORE_ARENA_H
#define VERGENCE_CORE_ARENA_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Alignment in bytes of every allocation (a cache line, an AVX-512 register).
enum { ARENA_ALIGNMENT = 64 };

/// Memory that is faster than the rest, such as that within a processor: for what loops use most.
struct arena_fast {
    unsigned char *base;
    size_t size_bytes;
    size_t used_bytes;
};
enum { ARENA_FAST_BLOCKS = 3 };

struct arena {
    unsigned char *base;
    size_t size_bytes;
    size_t used_bytes;
    size_t peak_bytes;
    struct arena_fast fast[ARENA_FAST_BLOCKS];
    struct arena_loan *loan;  // the last allocation in fast memory
};

/// Gives the arena the use of `size_bytes` at `memory`; the caller keeps ownership and must keep it
/// alive. `memory` may be NULL if `size_bytes` is 0.
void arena_init(struct arena *arena, void *memory, size_t size_bytes);

/// Allocates `count` elements of `element_bytes`, aligned, not cleared; NULL if they do not fit or
/// the product overflows. Valid until released.
void *arena_take(struct arena *arena, size_t count, size_t element_bytes);

/// Lends fast memory; a processor without any lends none. ARENA_ALIGNMENT bytes at both its ends
/// stay unused: loops read up to 3 bytes before a row and 32 behind it (stereo/bfin/cells.h), where
/// a bank of memory may end.
void arena_lend_fast(struct arena *arena, void *memory, size_t size_bytes);

/// As `arena_take`, in fast memory where it fits. What it takes of the rest is no more than that.
void *arena_take_fast(struct arena *arena, size_t count, size_t element_bytes);

/// What is free, as an arena of its own; the other one takes nothing while it is in use.
struct arena arena_rest(const struct arena *arena);

/// The present fill level, for `arena_release`.
size_t arena_mark(const struct arena *arena);

/// Releases everything allocated since `mark`.
void arena_release(struct arena *arena, size_t mark);

/// Upper bound of the memory that `arena_take(count, element_bytes)` uses, for adding up
/// requirements.
size_t arena_need_bytes(size_t count, size_t element_bytes);

#ifdef __cplusplus
}
#endif

#endif
