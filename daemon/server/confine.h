// SPDX-License-Identifier: Apache-2.0
/// Confines the process: no new privileges, and only the system calls needed to serve clients and
/// the instrument.
#ifndef VERGENCE_DAEMON_SERVER_CONFINE_H
#define VERGENCE_DAEMON_SERVER_CONFINE_H

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Confines all threads, irrevocably. A call that is not on the list fails with EPERM. Returns 0;
/// ERROR_UNSUPPORTED if built without libseccomp; ERROR_IO if the system refused. Errors set
/// `message`.
int confine_process(struct message *message);

#ifdef __cplusplus
}
#endif

#endif
