// SPDX-License-Identifier: Apache-2.0
/// Identification of this build.
#ifndef VERGENCE_DAEMON_BASE_VERSION_H
#define VERGENCE_DAEMON_BASE_VERSION_H

#ifdef __cplusplus
extern "C" {
#endif

/// "1.2.3"; static storage, like the others here.
const char *version_text(void);

/// Output of `git describe --always --dirty` at build time, or "unknown".
const char *version_build_id(void);

/// Date of the commit, "2026-01-31"; outside of a repository the day of the build.
const char *version_build_date(void);

#ifdef __cplusplus
}
#endif

#endif
