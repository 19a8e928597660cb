/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The asynchronous memory of the board: a flash of 4 MB with AMD's commands on 16 bits, as the
 * M29W320. VERGENCE_FLASH names the file that keeps it, else it is erased at each start.
 * VERGENCE_FLASH_CUT=N: the power fails in the Nth word programmed or sector erased.  */
#define dv_bfin_ebiu_amc_descriptor stock_bfin_ebiu_amc_descriptor
#include "bfin/dv-bfin_ebiu_amc.c"
#undef dv_bfin_ebiu_amc_descriptor

#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

enum {
    FLASH_BYTES = 4 << 20,
    SECTOR_BYTES = 64 << 10,
    CYCLES_PER_US = 600,
    PROGRAM_US = 10,
    ERASE_US = 800000,
    STATUS_TOGGLE = 0x40,
    STATUS_DATA = 0x80,
};

/* A step of a command: the address on the chip's lower lines, and the value.  */
static const struct {
    unsigned word;
    bu16 value;
} unlock[] = {{0x555, 0xAA}, {0x2AA, 0x55}};

static struct {
    uint8_t *bytes;
    unsigned step; /* unlock cycles seen */
    bu16 command;  /* what they unlocked; 0: none */
    bool erases;   /* the second unlock of an erasure */
    int64_t ready_at;
    bu16 status;
    unsigned long until_cut; /* 0: never */
} flash;

/* False: the power fails in it.  */
static bool goes_on(void) {
    return flash.until_cut == 0 || --flash.until_cut > 0;
}

static void begin(struct hw *me, unsigned us, bu16 status) {
    flash.ready_at = hw_event_queue_time(me) + (int64_t)us * CYCLES_PER_US;
    flash.status = status;
}

static void program(struct hw *me, unsigned offset, bu16 value) {
    bu16 word;
    bool whole = goes_on();
    memcpy(&word, flash.bytes + offset, sizeof word);
    word &= whole ? value : value | 0x5555;
    memcpy(flash.bytes + offset, &word, sizeof word);
    if (!whole)
        exit(0);
    begin(me, PROGRAM_US, ~value & STATUS_DATA);
}

static void erase(struct hw *me, unsigned offset) {
    bool whole = goes_on();
    memset(flash.bytes + offset / SECTOR_BYTES * SECTOR_BYTES, 0xFF,
           whole ? SECTOR_BYTES : SECTOR_BYTES / 2);
    if (!whole)
        exit(0);
    begin(me, ERASE_US, 0);
}

static void take(struct hw *me, unsigned offset, bu16 value) {
    bu16 command = flash.command;
    bool erases = flash.erases;
    flash.command = 0;
    if (command == 0xA0) {
        program(me, offset, value);
    } else if (flash.step < 2) {
        bool next =
            (offset / 2 & 0x7FF) == unlock[flash.step].word && value == unlock[flash.step].value;
        flash.step = next ? flash.step + 1 : 0;
        flash.erases = next && (erases || command == 0x80);
    } else {
        flash.step = 0;
        flash.erases = false;
        if (erases && value == 0x30)
            erase(me, offset);
        else
            flash.command = value;
        flash.erases = flash.command == 0x80;
    }
}

static bool is_flash(const struct bfin_ebiu_amc *amc, address_word addr) {
    return addr >= amc->bank_base && addr < amc->bank_base + FLASH_BYTES;
}

static unsigned amc_write(struct hw *me, const void *source, int space, address_word addr,
                          unsigned nr_bytes) {
    struct bfin_ebiu_amc *amc = hw_data(me);
    if (!is_flash(amc, addr))
        return bfin_ebiu_amc_io_write_buffer(me, source, space, addr, nr_bytes);
    if (nr_bytes == 2 && hw_event_queue_time(me) >= flash.ready_at)
        take(me, addr - amc->bank_base, dv_load_2(source));
    return nr_bytes;
}

static unsigned amc_read(struct hw *me, void *dest, int space, address_word addr,
                         unsigned nr_bytes) {
    struct bfin_ebiu_amc *amc = hw_data(me);
    if (!is_flash(amc, addr))
        return bfin_ebiu_amc_io_read_buffer(me, dest, space, addr, nr_bytes);
    memcpy(dest, flash.bytes + (addr - amc->bank_base), nr_bytes);
    if (hw_event_queue_time(me) < flash.ready_at) {
        flash.status ^= STATUS_TOGGLE;
        memset(dest, 0, nr_bytes);
        if (nr_bytes == 2)
            dv_store_2(dest, flash.status);
    }
    return nr_bytes;
}

static void open_flash(struct hw *me) {
    const char *name = getenv("VERGENCE_FLASH"), *cut = getenv("VERGENCE_FLASH_CUT");
    int file = name == NULL ? -1 : open(name, O_RDWR | O_CREAT, 0666);
    off_t bytes = file < 0 ? 0 : lseek(file, 0, SEEK_END);
    if (name != NULL && (file < 0 || (bytes < FLASH_BYTES && ftruncate(file, FLASH_BYTES) != 0)))
        hw_abort(me, "VERGENCE_FLASH: %s cannot be written", name);
    flash.bytes = mmap(NULL, FLASH_BYTES, PROT_READ | PROT_WRITE,
                       file < 0 ? MAP_PRIVATE | MAP_ANONYMOUS : MAP_SHARED, file, 0);
    if (flash.bytes == MAP_FAILED)
        hw_abort(me, "no memory for the flash");
    if (bytes < FLASH_BYTES)
        memset(flash.bytes, 0xFF, FLASH_BYTES);
    flash.until_cut = cut == NULL ? 0 : strtoul(cut, NULL, 10);
}

static void amc_finish(struct hw *me) {
    struct bfin_ebiu_amc *amc;
    bfin_ebiu_amc_finish(me);
    amc = hw_data(me);
    open_flash(me);
    set_hw_io_read_buffer(me, amc_read);
    set_hw_io_write_buffer(me, amc_write);
    for (size_t i = 0; i < ARRAY_SIZE(amc->slaves); i++)
        amc->slaves[i] = me;
    bfin_ebiu_amc_write_amgctl(me, amc, amc->amgctl);
}

const struct hw_descriptor dv_bfin_ebiu_amc_descriptor[] = {
    {
        "bfin_ebiu_amc",
        amc_finish,
    },
    {NULL, NULL},
};
