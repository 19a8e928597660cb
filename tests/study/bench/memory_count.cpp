// SPDX-License-Identifier: Apache-2.0
#include "bench/memory_count.hpp"

#include <malloc.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>

// gcc has a macro for it, clang a feature test.
#if defined(__SANITIZE_ADDRESS__)
#define COUNTS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define COUNTS 0
#endif
#endif
#ifndef COUNTS
#define COUNTS 1
#endif

namespace {

std::atomic<std::ptrdiff_t> now_bytes{0};
std::atomic<std::ptrdiff_t> peak_bytes{0};
std::ptrdiff_t begin_bytes = 0;

#if COUNTS
void count_in(void *memory) {
    if (memory == nullptr) {
        return;
    }
    const auto size = static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
    const std::ptrdiff_t now = now_bytes.fetch_add(size, std::memory_order_relaxed) + size;
    std::ptrdiff_t peak = peak_bytes.load(std::memory_order_relaxed);
    while (now > peak && !peak_bytes.compare_exchange_weak(peak, now, std::memory_order_relaxed)) {
    }
}

void count_out(void *memory) {
    if (memory != nullptr) {
        now_bytes.fetch_sub(static_cast<std::ptrdiff_t>(malloc_usable_size(memory)),
                            std::memory_order_relaxed);
    }
}
#endif

}  // namespace

#if COUNTS
// The GNU C library exports its allocator under these names for replacements.
extern "C" {
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);

void *malloc(size_t size) {
    void *memory = __libc_malloc(size);
    count_in(memory);
    return memory;
}

void *calloc(size_t count, size_t size) {
    void *memory = __libc_calloc(count, size);
    count_in(memory);
    return memory;
}

void *realloc(void *old, size_t size) {
    count_out(old);
    void *memory = __libc_realloc(old, size);
    if (memory == nullptr && size > 0) {
        count_in(old);  // still allocated
    }
    count_in(memory);
    return memory;
}

void *memalign(size_t alignment, size_t size) {
    void *memory = __libc_memalign(alignment, size);
    count_in(memory);
    return memory;
}

void *aligned_alloc(size_t alignment, size_t size) {
    return memalign(alignment, size);
}

int posix_memalign(void **memory, size_t alignment, size_t size) {
    void *taken = memalign(alignment, size);
    if (taken == nullptr) {
        return ENOMEM;
    }
    *memory = taken;
    return 0;
}

void free(void *memory) {
    count_out(memory);
    __libc_free(memory);
}
}
#endif

void memory_count_begin() {
    begin_bytes = now_bytes.load();
    peak_bytes.store(begin_bytes);
}

std::size_t memory_count_peak_bytes() {
    return static_cast<std::size_t>(peak_bytes.load() - begin_bytes);
}
