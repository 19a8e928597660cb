// SPDX-License-Identifier: Apache-2.0
/// Order statistics of values in memory, which they rearrange.
#ifndef VERGENCE_CORE_ORDER_H
#define VERGENCE_CORE_ORDER_H

#ifdef __cplusplus
extern "C" {
#endif

/// The value that is at `index`, 0 .. count - 1, of the sorted values (C. A. R. Hoare, "Find", CACM
/// 1961); 0 without values.
float order_statistic(float *values, int count, int index);

/// Sorts a few values, the smallest first.
void order_sort(double *values, unsigned count);

#ifdef __cplusplus
}
#endif

#endif
