# SPDX-License-Identifier: Apache-2.0
# The BF537 without an operating system. tools/bfin-toolchain builds the compiler into VERGENCE_CROSS_ROOT.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR bfin)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VERGENCE_CROSS_ROOT)
set(CMAKE_C_COMPILER ${VERGENCE_CROSS_ROOT}/bin/bfin-elf-gcc)
set(CMAKE_ASM_COMPILER ${VERGENCE_CROSS_ROOT}/bin/bfin-elf-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_FIND_ROOT_PATH ${VERGENCE_CROSS_ROOT}/bfin-elf)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
# gcc 12 takes x >> 1 of 64 bits for two halves and then the wrong bit between them, unless they stay together.
add_compile_options(-mcpu=bf537 -ffunction-sections -fdata-sections -fno-split-wide-types)
add_link_options(-mcpu=bf537 -Wl,--gc-sections)
