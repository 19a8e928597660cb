# SPDX-License-Identifier: Apache-2.0
# Linux on the BF537: static FDPIC programs with uClibc-ng. tools/cross.d/build_fdpic builds the library into
# VERGENCE_CROSS_ROOT, a folder of the compiler's.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR bfin)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES VERGENCE_CROSS_ROOT)
set(CMAKE_C_COMPILER ${VERGENCE_CROSS_ROOT}/../bin/bfin-elf-gcc)
set(CMAKE_FIND_ROOT_PATH ${VERGENCE_CROSS_ROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# The compiler's own C library is another one.
set(CMAKE_C_FLAGS_INIT "-mfdpic -mcpu=bf537 -nostdinc")
set(CMAKE_C_STANDARD_INCLUDE_DIRECTORIES
  ${VERGENCE_CROSS_ROOT}/include ${VERGENCE_CROSS_ROOT}/compiler/include
  ${VERGENCE_CROSS_ROOT}/compiler/include-fixed ${VERGENCE_CROSS_ROOT}/kernel)
set(lib ${VERGENCE_CROSS_ROOT}/lib)
set(CMAKE_EXE_LINKER_FLAGS_INIT
  "-static -nostdlib ${lib}/crt1.o ${lib}/crti.o ${lib}/crtreloc.o -L${lib} -Wl,-z,noexecstack")
set(CMAKE_C_STANDARD_LIBRARIES "-lm -lc -lgcc -lc ${lib}/crtn.o")

# As in bfin.cmake.
add_compile_options(-ffunction-sections -fdata-sections -fno-split-wide-types)
add_link_options(-Wl,--gc-sections)
