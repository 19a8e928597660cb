// SPDX-License-Identifier: Apache-2.0
#include "core/order.h"

#include "core/invariant.h"

float order_statistic(float *values, int count, int index) {
    int low = 0, high = count - 1;
    INVARIANT(count >= 0 && index >= 0 && (index < count || count == 0));
    while (low < high) {
        const float pivot = values[index];
        int i = low, j = high;
        while (i <= j) {
            while (values[i] < pivot) {
                i++;
            }
            while (values[j] > pivot) {
                j--;
            }
            if (i <= j) {
                const float kept = values[i];
                values[i++] = values[j];
                values[j--] = kept;
            }
        }
        if (j < index) {
            low = i;
        }
        if (i > index) {
            high = j;
        }
    }
    return count > 0 ? values[index] : 0;
}

void order_sort(double *values, unsigned count) {
    for (unsigned i = 1; i < count; i++) {
        const double value = values[i];
        unsigned at = i;
        for (; at > 0 && values[at - 1] > value; at--) {
            values[at] = values[at - 1];
        }
        values[at] = value;
    }
}
