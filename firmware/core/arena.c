// SPDX-License-Identifier: Apache-2.0
#include "core/arena.h"

#include <stdint.h>

#include "core/invariant.h"

void arena_init(struct arena *arena, void *memory, size_t size_bytes) {
    INVARIANT(memory != NULL || size_bytes == 0);
    *arena = (struct arena){.base = memory, .size_bytes = size_bytes};
}

// What is in fast memory: each has a record in the rest, whose place says until when it is taken.
struct arena_loan {
    struct arena_loan *before;
    int block;
    size_t used_bytes;  // of the block, without it
};

void arena_lend_fast(struct arena *arena, void *memory, size_t size_bytes) {
    int i = 0;
    while (arena->fast[i].size_bytes != 0) {
        i++;
        INVARIANT(i < ARENA_FAST_BLOCKS);
    }
    INVARIANT((uintptr_t)memory % ARENA_ALIGNMENT == 0);
    INVARIANT(size_bytes > 2 * (size_t)ARENA_ALIGNMENT);
    arena->fast[i] = (struct arena_fast){
        .base = (unsigned char *)memory + ARENA_ALIGNMENT,
        .size_bytes = size_bytes - 2 * (size_t)ARENA_ALIGNMENT,
    };
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

void *arena_take_fast(struct arena *arena, size_t count, size_t element_bytes) {
    if (element_bytes != 0 && count > SIZE_MAX / element_bytes) {
        return NULL;
    }
    const size_t bytes = count * element_bytes;
    int block = 0;
    while (block < ARENA_FAST_BLOCKS &&
           arena->fast[block].size_bytes - arena->fast[block].used_bytes < bytes) {
        block++;
    }
    if (block == ARENA_FAST_BLOCKS || bytes < sizeof *arena->loan) {
        return arena_take(arena, count, element_bytes);
    }
    struct arena_loan *loan = arena_take(arena, 1, sizeof *loan);
    if (loan == NULL) {
        return NULL;
    }
    struct arena_fast *fast = &arena->fast[block];
    *loan = (struct arena_loan){arena->loan, block, fast->used_bytes};
    arena->loan = loan;
    unsigned char *result = fast->base + fast->used_bytes;
    fast->used_bytes += bytes + padding_bytes(bytes);
    if (fast->used_bytes > fast->size_bytes) {
        fast->used_bytes = fast->size_bytes;
    }
    return result;
}

struct arena arena_rest(const struct arena *arena) {
    struct arena rest = *arena;
    rest.base += arena->used_bytes;
    rest.size_bytes -= arena->used_bytes;
    rest.used_bytes = rest.peak_bytes = 0;
    rest.loan = NULL;
    return rest;
}

size_t arena_mark(const struct arena *arena) {
    return arena->used_bytes;
}

void arena_release(struct arena *arena, size_t mark) {
    INVARIANT(mark <= arena->used_bytes);
    arena->used_bytes = mark;
    for (; arena->loan != NULL && (unsigned char *)arena->loan >= arena->base + mark;
         arena->loan = arena->loan->before) {
        arena->fast[arena->loan->block].used_bytes = arena->loan->used_bytes;
    }
}

size_t arena_need_bytes(size_t count, size_t element_bytes) {
    return count * element_bytes + ARENA_ALIGNMENT;
}
