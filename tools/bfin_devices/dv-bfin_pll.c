/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The clocks as a boot loader leaves them: 25 MHz x 24 = 600 MHz, a fifth of that for the system.
   The simulator's own model has the registers of another board.  */
#define dv_bfin_pll_descriptor stock_bfin_pll_descriptor
#include "bfin/dv-bfin_pll.c"
#undef dv_bfin_pll_descriptor

static void pll_finish(struct hw *me) {
    bfin_pll_finish(me);
    struct bfin_pll *pll = hw_data(me);
    pll->pll_ctl = 24 << 9;
    pll->pll_div = 5;
}

const struct hw_descriptor dv_bfin_pll_descriptor[] = {
    {
        "bfin_pll",
        pll_finish,
    },
    {NULL, NULL},
};
