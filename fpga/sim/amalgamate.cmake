# SPDX-License-Identifier: Apache-2.0
# Writes OUT, which includes FIRST and every C++ file that Verilator left in FOLDER.
file(GLOB sources ${FOLDER}/*.cpp)
list(SORT sources)
set(text "#include \"${FIRST}\"\n")
foreach(source ${sources})
  string(APPEND text "#include \"${source}\"\n")
endforeach()
file(WRITE ${OUT} "${text}")
