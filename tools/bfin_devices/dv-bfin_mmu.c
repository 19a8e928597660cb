/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Counts what the program moves to and from SDRAM, and what would still go there with both caches
   on (Blackfin Programming Reference, chapter 6): lines of 32 bytes, least recently used first; 16
   KB of instructions in 4 ways, 32 KB of data in 2 ways, written back. No instruction takes longer
   by it; DMA and flushes are not counted. A load from COUNTERS finds the counts of all before it,
   and the first one starts them; the run has to put memory there: --memory-region 0x90000000,0x10.
 */
#define mmu_check_addr stock_mmu_check_addr
#include "bfin/dv-bfin_mmu.c"
#undef mmu_check_addr

enum { SDRAM_END = 0x20000000, SETS = 512, MOST_WAYS = 4, DIRTY = 1, VALID = 2 };
#define COUNTERS 0x90000000u

struct cache {
    int ways;
    bu32 index_bits;             /* of an address */
    bu32 lines[SETS][MOST_WAYS]; /* address and flags, the last used one first */
};

static bool counts;
static struct {
    bu32 loaded_bytes, stored_bytes; /* of data, as without a cache */
    bu32 filled_lines, written_lines;
} counters;
static struct cache instructions = {.ways = 4, .index_bits = 0x33E0};
static struct cache data = {.ways = 2, .index_bits = 0x77E0};

static void use_line(struct cache *cache, bu32 addr, bool write) {
    const bu32 line = addr & ~(BFIN_L1_CACHE_BYTES - 1), index = addr & cache->index_bits;
    bu32 *ways = cache->lines[(index & 0x7E0) >> 5 | (index & 0x7000) >> 6];
    int at = 0;
    while (at < cache->ways - 1 && ((ways[at] ^ line) & ~DIRTY) != VALID) {
        at++;
    }
    bu32 found = ways[at];
    if (((found ^ line) & ~DIRTY) != VALID) {
        counters.filled_lines++;
        counters.written_lines += found & DIRTY;
        found = line | VALID;
    }
    memmove(ways + 1, ways, at * sizeof *ways);
    ways[0] = found | (write ? DIRTY : 0);
}

void mmu_check_addr(SIM_CPU *, bu32 addr, bool write, bool inst, int size);

void mmu_check_addr(SIM_CPU *cpu, bu32 addr, bool write, bool inst, int size) {
    stock_mmu_check_addr(cpu, addr, write, inst, size);
    if (addr - COUNTERS < sizeof counters) {
        counts = true;
        sim_core_write_buffer(CPU_STATE(cpu), cpu, write_map, &counters, COUNTERS, sizeof counters);
    } else if (counts && addr < SDRAM_END) {
        use_line(inst ? &instructions : &data, addr, write);
        counters.loaded_bytes += inst || write ? 0 : size;
        counters.stored_bytes += write ? size : 0;
    }
}
