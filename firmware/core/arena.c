// SPDX-License-Identifier: Apache-2.0
#include "core/arena.h"

#include <stdint.h>

#include "core/invariant.h"

void arena_init(struct arena *arena, void *memory, size_t size_bytes) {
    INVARIANT(memory != NULL || size_bytes == 0);
    *arena = (struct arena){.base = memory, .size_bytes = size_bytes};
}

// Number of bytes from `address` to the next aligned address.
static size_t padding_bytes(uintptr_t address) {
    return (size_t)(-address & (uintptr_t)(ARENA_ALIGNMENT - 1));
}

void *arena_take(struct arena *arena, size_t count, size_t element_bytes) {
    INVARIANT(arena->used_bytes <= arena->size_bytes);
    if (element_bytes != 0 && count > SIZE_MAX / element_bytes) {
        return NULL;
    }
    const size_t wanted_bytes = count * element_bytes;
    const size_t free_bytes = arena->size_bytes - arena->used_bytes;
    const size_t pad_bytes = padding_bytes((uintptr_t)arena->base + arena->used_bytes);
    if (pad_bytes > free_bytes || wanted_bytes > free_bytes - pad_bytes) {
        return NULL;
    }
    unsigned char *result = arena->base + arena->used_bytes + pad_bytes;
    arena->used_bytes += pad_bytes + wanted_bytes;
    if (arena->used_bytes > arena->peak_bytes) {
        arena->peak_bytes = arena->used_bytes;
    }
    INVARIANT(((uintptr_t)result & (uintptr_t)(ARENA_ALIGNMENT - 1)) == 0);
    return result;
}

size_t arena_mark(const struct arena *arena) {
    return arena->used_bytes;
}

void arena_release(struct arena *arena, size_t mark) {
    INVARIANT(mark <= arena->used_bytes);
    arena->used_bytes = mark;
}

size_t arena_need_bytes(size_t count, size_t element_bytes) {
    return count * element_bytes + ARENA_ALIGNMENT;
}
