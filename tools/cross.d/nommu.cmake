# SPDX-License-Identifier: Apache-2.0
# 64-bit RISC-V without an MMU, with musl. Linux loads such a program anywhere, so it is linked
# static and position-independent: the default of the compiler that tools/cross.d/build_libraries makes.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR riscv64)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VERGENCE_CROSS_ROOT)
set(CMAKE_C_COMPILER ${VERGENCE_CROSS_ROOT}/bin/nommu-gcc)

# Libraries of this root alone and none of this machine's.
set(CMAKE_FIND_ROOT_PATH ${VERGENCE_CROSS_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_LIBDIR} ${VERGENCE_CROSS_ROOT}/lib/pkgconfig)
set(PKG_CONFIG_ARGN --static)

# Only what is called: there is no paging, so all of a program is in memory.
add_compile_options(-ffunction-sections -fdata-sections)
add_link_options(-Wl,--gc-sections)
# The C library relocates addresses but looks up no symbols. The linker counts relocations of sections that
# it drops: there are none in the text that stays.
add_link_options(-Wl,-z,notext,--exclude-libs,ALL)
