// SPDX-License-Identifier: Apache-2.0
/// What `measure` notes in the session that it takes, as comments between the commands:
///
///     # measure fit=360                        what was asked for, without the name
///     # measure step aim: the subject is ...   a decision with its reason, before it is carried
///                                              out
///     # measure surface pair=3 with-pair=2 near=1568.000 far=2082.000
///                                              the options of `reconstruct` that make its surface,
///                                              before that is computed; the last one counts
#ifndef VERGENCE_DAEMON_SESSION_SESSION_NOTES_H
#define VERGENCE_DAEMON_SESSION_SESSION_NOTES_H

#include "daemon/base/message.h"
#include "daemon/session/session.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SESSION_NOTE_MEASURE "# measure "
#define SESSION_NOTE_STEP SESSION_NOTE_MEASURE "step "
#define SESSION_NOTE_SURFACE SESSION_NOTE_MEASURE "surface "

enum { SESSION_NOTES_STEPS_BYTES = 16384 };

/// The last measurement of a session that came as far as its surface, else the last. Large: static
/// or allocated.
struct session_notes {
    char request[SESSION_TEXT_MAX + 1];
    char surface[SESSION_TEXT_MAX + 1];     // "": it ended before its surface
    char steps[SESSION_NOTES_STEPS_BYTES];  // a line each; those beyond it are left out
};

/// Reads them. Returns 1, or 0 if the session was not taken by `measure`; errors of
/// session_reader_open and session_reader_next.
int session_notes_read(int parent, const char *path, struct session_notes *notes,
                       struct message *message);

#ifdef __cplusplus
}
#endif

#endif
