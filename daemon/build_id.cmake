# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT (a header) with what git says about SOURCE; touches it only when that changed, so
# that a build without news compiles nothing.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --tags
                OUTPUT_VARIABLE build_id OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT build_id)
  set(build_id unknown)
endif()
set(text "// SPDX-License-Identifier: Apache-2.0\n#define VERGENCE_BUILD_ID \"${build_id}\"\n")
set(old "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} old)
endif()
if(NOT old STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
