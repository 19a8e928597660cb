# SPDX-License-Identifier: Apache-2.0
# Writes OUT, which includes FIRST and all C++ files of Verilator in FOLDER.
#
# Verilator checks three times which clocks have an edge; two of these find no edge. A test whether
# any clock has changed is inserted before each check, which saves a quarter of an evaluation's
# time. If a version of Verilator generates different code, nothing is found and nothing is changed.
file(GLOB sources ${FOLDER}/*.cpp)
list(SORT sources)
set(text "#include \"${FIRST}\"\n")
set(name "[A-Za-z0-9_]+")
foreach(source ${sources})
  file(READ ${source} body)
  string(REGEX MATCHALL "vlSelf->__Vtrigrprev__${name}[ \n]+= vlSelf->${name};" memories "${body}")
  set(head "void ${name}___eval_triggers__act\\(${name}\\* vlSelf\\) {")
  if(memories AND body MATCHES "${head}")
    set(function "${CMAKE_MATCH_0}")
    string(REGEX REPLACE "vlSelf->(${name})[ \n]+= (vlSelf->${name});" "(vlSelf->\\1 ^ \\2)"
      memories "${memories}")
    string(REPLACE ";" "\n      | " changed "${memories}")
    string(REPLACE "${function}" "${function}
    if ((${changed}) == 0) {
        vlSelf->__VactTriggered.clear();
        return;
    }" body "${body}")
    file(WRITE ${source} "${body}")
  endif()
  string(APPEND text "#include \"${source}\"\n")
endforeach()
file(WRITE ${OUT} "${text}")
