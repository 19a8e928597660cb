// SPDX-License-Identifier: Apache-2.0
/// Assertions about bugs in this program. They stay on in release builds. External data is checked
/// and rejected with an error code instead.
#ifndef VERGENCE_CORE_INVARIANT_H
#define VERGENCE_CORE_INVARIANT_H

#ifdef __cplusplus
extern "C" {
#endif

/// Called once if an invariant does not hold; must not return. The default traps; a program links
/// its own function that reports file and line before it stops.
#ifdef __cplusplus
[[noreturn]]
#else
_Noreturn
#endif
void invariant_failed(const char *file, int line, const char *condition);

#define INVARIANT(condition) \
    ((condition) ? (void)0 : invariant_failed(__FILE__, __LINE__, #condition))

#ifdef __cplusplus
}
#endif

#endif
