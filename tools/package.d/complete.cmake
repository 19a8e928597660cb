# SPDX-License-Identifier: Apache-2.0
# Adds what every Debian package has: copyright, changes, compressed manual pages. cpack runs it before
# it packs.
function(compress file)
  execute_process(COMMAND gzip -9nf ${file} COMMAND_ERROR_IS_FATAL ANY)
  file(CHMOD ${file}.gz PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
endfunction()

set(here ${CMAKE_CURRENT_LIST_DIR})
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} upper)
  set(name ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${component})
  set(docs ${root}/usr/share/doc/${name})
  file(MAKE_DIRECTORY ${docs})
  file(COPY_FILE ${here}/copyright ${docs}/copyright)
  file(COPY_FILE ${here}/../../CHANGELOG.md ${docs}/changelog)
  file(WRITE ${docs}/changelog.Debian
    "vergence (${CPACK_DEBIAN_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium\n\n"
    "  * Built by tools/package; changelog.gz says what is new.\n\n"
    " -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
  file(GLOB pages ${root}/usr/share/man/man*/*.[1-8])
  foreach(file ${pages} ${docs}/changelog ${docs}/changelog.Debian)
    compress(${file})
  endforeach()
  # Apache-2.0 is in Debian's own /usr/share/common-licenses.
  file(REMOVE ${root}/usr/share/doc/vergence/LICENSE)
endforeach()
