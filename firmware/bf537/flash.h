// SPDX-License-Identifier: Apache-2.0
/// One record in the board's flash, which a power failure leaves whole: the old or the new one.
#ifndef VERGENCE_BF537_FLASH_H
#define VERGENCE_BF537_FLASH_H

#include "hal/store.h"
#include "rig/rig.h"

/// The store, of one record of less than 448 KiB at a time: saving another name is ERROR_FULL, and
/// so is a longer record. `waiting` is called while it waits, but cannot stop it. Static storage.
const struct hal_store *bf537_flash_open(const struct rig_observer *waiting);

#endif
