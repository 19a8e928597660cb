// SPDX-License-Identifier: Apache-2.0
/// The process gives up what it does not need any more: new privileges, and all system calls but
/// those that serving clients and the instrument takes.
#ifndef VERGENCE_DAEMON_SERVER_CONFINE_H
#define VERGENCE_DAEMON_SERVER_CONFINE_H

#include "daemon/base/message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// For all threads, for good. A call that is not on the list fails with EPERM. 0;
/// ERROR_UNSUPPORTED: this program was built without libseccomp; ERROR_IO: the system did not do
/// it. With a message.
int confine_process(struct message *message);

#ifdef __cplusplus
}
#endif

#endif
