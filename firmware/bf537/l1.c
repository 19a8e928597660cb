// SPDX-License-Identifier: Apache-2.0
#include "bf537/l1.h"

#include "bf537/mmr.h"
#include "core/invariant.h"

void bf537_l1_load_text(void);

/// Stores do not reach the memory of instructions, so DMA copies what runs there (Hardware
/// Reference, chapter 5). start.S calls it first.
void bf537_l1_load_text(void) {
    const size_t words = (size_t)(bf537_l1_text_end - bf537_l1_text_begin) / sizeof(uint32_t);
    MDMA_S0_START_ADDR = (uint32_t)(uintptr_t)bf537_l1_text_load;
    MDMA_D0_START_ADDR = (uint32_t)(uintptr_t)bf537_l1_text_begin;
    MDMA_S0_X_COUNT = MDMA_D0_X_COUNT = (uint16_t)words;
    MDMA_S0_X_MODIFY = MDMA_D0_X_MODIFY = sizeof(uint32_t);
    MDMA_D0_IRQ_STATUS = DMA_DONE | DMA_ERROR;
    ssync();
    MDMA_S0_CONFIG = DMA_ENABLE | DMA_32_BITS;
    MDMA_D0_CONFIG = DMA_ENABLE | DMA_TO_MEMORY | DMA_32_BITS | DMA_INTERRUPT;
    ssync();
    while ((MDMA_D0_IRQ_STATUS & (DMA_DONE | DMA_ERROR)) == 0) {
    }
    INVARIANT((MDMA_D0_IRQ_STATUS & DMA_ERROR) == 0);
    MDMA_D0_IRQ_STATUS = DMA_DONE;
    MDMA_S0_CONFIG = MDMA_D0_CONFIG = 0;
    ssync();
}
