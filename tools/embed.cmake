# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT, a C++ file with a report's sources from FOLDER as the strings NAME_page, NAME_style
# and NAME_script, which NAME.hpp beside FOLDER's pages declares:
#   cmake -DOUTPUT=... -DFOLDER=... -DNAME=... "-DSCRIPTS=a.js b.js" -P embed.cmake
# The scripts are joined in the given order inside one function, so that no name leaks into the page.
function(append_string name text)
  string(FIND "${text}" ")embedded\"" clash)
  if(NOT clash EQUAL -1)
    message(FATAL_ERROR "embed.cmake: ${name} contains the mark that ends a string")
  endif()
  file(APPEND ${OUTPUT}.new "const char *const ${name} = R\"embedded(${text})embedded\";\n")
endfunction()

cmake_path(GET FOLDER FILENAME folder)
file(WRITE ${OUTPUT}.new "// SPDX-License-Identifier: Apache-2.0\n// Made by tools/embed.cmake.\n"
     "#include \"tools/host/${folder}/${NAME}.hpp\"\n\n")
file(READ ${FOLDER}/report.html page)
append_string(${NAME}_page "${page}")
file(READ ${FOLDER}/report.css style)
append_string(${NAME}_style "${style}")
separate_arguments(scripts UNIX_COMMAND "${SCRIPTS}")
set(joined "(() => {\n'use strict';\n")
foreach(script IN LISTS scripts)
  file(READ ${FOLDER}/${script} text)
  string(APPEND joined "${text}")
endforeach()
append_string(${NAME}_script "${joined}})();\n")
file(RENAME ${OUTPUT}.new ${OUTPUT})
