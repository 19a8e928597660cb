// SPDX-License-Identifier: Apache-2.0
/// Which build this is.
#ifndef VERGENCE_DAEMON_BASE_VERSION_H
#define VERGENCE_DAEMON_BASE_VERSION_H

#ifdef __cplusplus
extern "C" {
#endif

/// "1.2.3"; static storage, as the others here.
const char *version_text(void);

/// What `git describe --always --dirty` said when the program was built, or "unknown".
const char *version_build_id(void);

/// Of the commit that was built, "2026-01-31"; outside of a repository of the day of the build.
const char *version_build_date(void);

#ifdef __cplusplus
}
#endif

#endif
