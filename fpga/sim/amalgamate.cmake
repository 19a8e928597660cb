# SPDX-License-Identifier: Apache-2.0
# Writes OUT, which includes FIRST and every C++ file that Verilator left in FOLDER.
#
# Of three times that it asks which clocks have an edge, two find none. Before it looks at each of
# them, it now sees whether any has changed at all: that is a quarter of an evaluation's time. Where a
# version of Verilator asks in another way, nothing is found here and nothing changed.
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
