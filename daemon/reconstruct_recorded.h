// SPDX-License-Identifier: Apache-2.0
/// A recorded session in place of two images, on the command line of `vergence reconstruct`.
#ifndef VERGENCE_DAEMON_RECONSTRUCT_RECORDED_H
#define VERGENCE_DAEMON_RECONSTRUCT_RECORDED_H

#include <stdbool.h>

#include "daemon/message.h"
#include "daemon/reconstruct_request.h"
#include "daemon/session_pairs.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Makes the request one for the images of the session that it names: their paths, whether they are
/// raw, and the session's calibration where no other was given and the pair is not rectified. The
/// paths stand in `files`, which must outlive the request. `*own`: it is the session's calibration,
/// which reconstruct_session_read fits to the frames. Nothing happens without a session. 0, or an
/// error with `message` set.
int reconstruct_recorded_resolve(struct reconstruct_request *request,
                                 struct session_pair_files *files, bool *own,
                                 struct message *message);

#ifdef __cplusplus
}
#endif

#endif
