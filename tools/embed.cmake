# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT, a C file with the text of files as zero-terminated strings:
#   cmake -DOUTPUT=... "-DTEXTS=NAME|FILE|FILE;NAME|FILE" -P embed.cmake
# defines `const char *const NAME` with the files' texts one after the other. Called by vergence_embed (folders.cmake).
file(WRITE ${OUTPUT}.new "// SPDX-License-Identifier: Apache-2.0\n// Made by tools/embed.cmake.\n")
foreach(text IN LISTS TEXTS)
  string(REPLACE "|" ";" files "${text}")
  list(POP_FRONT files name)
  set(bytes)
  foreach(file IN LISTS files)
    file(READ ${file} digits HEX)
    string(APPEND bytes ${digits})
  endforeach()
  # As numbers, because the standard limits the length of a string literal.
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${bytes}")
  file(APPEND ${OUTPUT}.new
       "static const unsigned char ${name}_bytes[] = {${bytes}0};\n"
       "extern const char *const ${name};\n"
       "const char *const ${name} = (const char *)${name}_bytes;\n")
endforeach()
file(RENAME ${OUTPUT}.new ${OUTPUT})
