# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT (a header) with what git says about SOURCE; touches it only when that changed, so
# that a build without news compiles nothing.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --tags
                OUTPUT_VARIABLE build_id OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT build_id)
  set(build_id unknown)
endif()
execute_process(COMMAND git -C ${SOURCE} log -1 --format=%cs
                OUTPUT_VARIABLE build_date OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT build_date)
  string(TIMESTAMP build_date %Y-%m-%d UTC)
endif()
string(CONCAT text
       "// SPDX-License-Identifier: Apache-2.0\n#define VERGENCE_BUILD_ID \"${build_id}\"\n"
       "#define VERGENCE_BUILD_DATE \"${build_date}\"\n")
set(old "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} old)
endif()
if(NOT old STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
