# SPDX-License-Identifier: Apache-2.0
# 32-bit ARM with a floating-point unit, as Debian's armhf: ARMv7 without NEON. tools/cross unpacks
# the libraries into VERGENCE_CROSS_ROOT.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-linux-gnueabihf-gcc)
set(CMAKE_LIBRARY_ARCHITECTURE arm-linux-gnueabihf)

# Libraries of this root alone and none of this machine's.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VERGENCE_CROSS_ROOT)
set(CMAKE_FIND_ROOT_PATH ${VERGENCE_CROSS_ROOT} /usr/arm-linux-gnueabihf)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(ENV{PKG_CONFIG_LIBDIR} ${VERGENCE_CROSS_ROOT}/usr/lib/arm-linux-gnueabihf/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${VERGENCE_CROSS_ROOT})
set(PKG_CONFIG_ARGN --static)

# Small, but for the loops over pixels, which set their own -O3; and only what is called.
add_compile_options(-Os -ffunction-sections -fdata-sections)
add_link_options(-Wl,--gc-sections)
