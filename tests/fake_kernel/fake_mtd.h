// SPDX-License-Identifier: Apache-2.0
/// Fake partitions of NOR flash: /dev/mtdN, whose contents are a file, and /proc/mtd. Writing only
/// clears bits, erasing sets those of whole blocks.
#ifndef VERGENCE_TESTS_FAKE_MTD_H
#define VERGENCE_TESTS_FAKE_MTD_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FAKE_MTDS = 4 };

struct fake_mtd {
    char name[32];
    uint8_t *data;  ///< the file
    uint32_t bytes, block_bytes;
    uint8_t type;  ///< MTD_NORFLASH
    uint32_t flags;
    bool worn;  ///< one bit cannot be cleared
};

/// Adds the next partition; its file exists and has a whole number of blocks, else NULL. Lives
/// until fake_mtd_forget.
struct fake_mtd *fake_mtd_add(const char *name, const char *file, uint32_t block_bytes);
/// Removes all partitions.
void fake_mtd_forget(void);

#ifdef __cplusplus
}
#endif

#endif
