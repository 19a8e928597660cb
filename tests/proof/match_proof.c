// SPDX-License-Identifier: Apache-2.0
// Input of Frama-C: the plain row kernels as compiled, after facts about bits and contracts of the
// two functions without a source here.
#include "bit_facts.h"  // written by prove.py

/*@ requires bits != 0;
    assigns \nothing;
    ensures 0 <= \result < 32;
    ensures bits <= 0xffff ==> \result < 16; */
int counted_zeros(unsigned bits);
#define __builtin_ctz counted_zeros

// An invariant that a contract implies must be proved.
/*@ requires \false;
    assigns \nothing;
    ensures \false; */
_Noreturn void invariant_failed(const char *file, int line, const char *condition);

#include "stereo/match/vector_plain.h"
// The steps use the vectors included above.
#include "stereo/match/kernels_text.h"
