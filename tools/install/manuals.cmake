# SPDX-License-Identifier: Apache-2.0
# Writes the manual pages (OUTPUT/man) and the bash completion (OUTPUT/completion.bash) from the output
# of the programs themselves:
#   cmake -DVERGENCE=... -DVERGENCED=... -DSIMRIG=... -DOUTPUT=... -P manuals.cmake
# SIMRIG is empty if it was not built.
function(print variable)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

function(write_page name)
  string(REGEX MATCH "[0-9]$" section ${name})
  print(page ${ARGN})
  file(WRITE ${OUTPUT}/man/man${section}/${name} "${page}")
endfunction()

# A program that shares no code with the others: its help becomes a page unchanged.
function(help_page name summary program)
  print(help ${program} --help)
  string(REPLACE "\\" "\\e" help "${help}")
  string(REPLACE "-" "\\-" help "${help}")
  string(REPLACE "'" "\\(aq" help "${help}")
  string(REGEX REPLACE "\n\\." "\n\\\\&." help "${help}")
  file(STRINGS ${OUTPUT}/man/man1/vergence.1 head REGEX "^\\.TH ")
  string(TOUPPER ${name} title)
  string(REPLACE "TH VERGENCE" "TH ${title}" head "${head}")
  string(REPLACE "-" "\\-" escaped ${name})
  file(WRITE ${OUTPUT}/man/man1/${name}.1 "${head}\n.SH NAME\n${escaped} \\- ${summary}\n"
       ".SH DESCRIPTION\n.nf\n${help}.fi\n.SH SEE ALSO\n.BR vergence\\-simulate (1)\n")
endfunction()

# Removes pages that no longer exist.
file(REMOVE_RECURSE ${OUTPUT}/man)
write_page(vergence.1 ${VERGENCE} help --man)
print(names ${VERGENCE} help --names)
string(REGEX MATCHALL "[^\n]+" names "${names}")
foreach(name IN LISTS names)
  string(REPLACE " " "-" page_name "${name}")
  separate_arguments(page_words UNIX_COMMAND "${name}")
  write_page(vergence-${page_name}.1 ${VERGENCE} help --man ${page_words})
endforeach()

print(client_words ${VERGENCE} help --words)
print(daemon_words ${VERGENCED} --help-words)
set(words "${client_words}${daemon_words}")
if(SIMRIG)
  get_filename_component(scripts ${SIMRIG} DIRECTORY)
  set(scripts ${scripts}/..)
  help_page(simrig "the simulated rig" ${SIMRIG})
  help_page(simrig-control "control commands for a simulated rig"
            ${scripts}/simrig-control)
  help_page(simrig-compare "compares a surface with the truth of a simulated rig"
            ${scripts}/simrig-compare)
  foreach(kind scenes rigs)
    file(GLOB files ${CMAKE_CURRENT_LIST_DIR}/../simrig/${kind}/*.yaml)
    list(TRANSFORM files REPLACE ".*/([^/]*)\\.yaml$" "\\1")
    list(JOIN files " " ${kind})
  endforeach()
  string(APPEND words "_vergence_words['vergence simulate']+=' ${scenes}'\n"
         "_vergence_words['vergence simulate --rig']='${rigs}'\n")
endif()
configure_file(${CMAKE_CURRENT_LIST_DIR}/completion.bash.in ${OUTPUT}/completion.bash @ONLY)
