// SPDX-License-Identifier: Apache-2.0
/// Working memory lent by the caller, handed out from the bottom up and given
/// back all at once or down to a mark. Its peak is measured, so that a build can
/// say how much memory a job needs.
#ifndef VERGENCE_CORE_ARENA_H
#define VERGENCE_CORE_ARENA_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Alignment in bytes of everything an arena hands out (a cache line, an AVX-512 register).
enum { ARENA_ALIGNMENT = 64 };

struct arena {
    unsigned char *base;
    size_t size_bytes;
    size_t used_bytes;
    size_t peak_bytes;
};

/// Lends `size_bytes` at `memory` to the arena; the caller keeps owning it and
/// must keep it alive. `memory` may be NULL when `size_bytes` is 0.
void arena_init(struct arena *arena, void *memory, size_t size_bytes);

/// Memory for `count` elements of `element_bytes`, aligned, not cleared; NULL when
/// it does not fit or the product overflows. Valid until released.
void *arena_take(struct arena *arena, size_t count, size_t element_bytes);

/// The present fill, to be handed to `arena_release` later.
size_t arena_mark(const struct arena *arena);

/// Gives back all that was taken since `mark`.
void arena_release(struct arena *arena, size_t mark);

/// Upper bound of what `arena_take(count, element_bytes)` consumes, for summing up needs.
size_t arena_need_bytes(size_t count, size_t element_bytes);

#ifdef __cplusplus
}
#endif

#endif
