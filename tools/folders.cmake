# SPDX-License-Identifier: Apache-2.0
# One folder, one static library. tools/arrows.txt names the folders that each may include; a folder
# that it does not name is not on a target's include path, so that a wrong-way include does not
# compile.

file(STRINGS ${PROJECT_SOURCE_DIR}/tools/arrows.txt vergence_arrows REGEX "^[a-z]")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tools/arrows.txt)

# firmware/core -> core, daemon/base -> daemon_base, tools/host/formats -> host_formats
function(vergence_target folder result)
  string(REGEX REPLACE "^(firmware|tools)/" "" name ${folder})
  string(REPLACE "/" "_" name ${name})
  set(${result} ${name} PARENT_SCOPE)
endfunction()

# vergence_folder(FOLDER SOURCE...): the library of a folder; a folder of headers has no sources.
# Its headers are included by their path below firmware/ or below the root, through a link in the
# build directory that leads to this folder alone. ccache notes a header by the shorter of its two
# paths, through the link and without; the latter leads to this checkout for all that share the
# cache, so the link's must be the shorter: i/ and five digits.
function(vergence_folder folder)
  vergence_target(${folder} target)
  set(sources ${ARGN})
  if(sources)
    list(TRANSFORM sources PREPEND ${PROJECT_SOURCE_DIR}/${folder}/)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE vergence_warnings)
    set_property(GLOBAL APPEND PROPERTY VERGENCE_LIBRARIES ${target})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  if(folder MATCHES "^daemon/")
    target_compile_definitions(${target} PRIVATE _GNU_SOURCE)
  endif()
  string(REGEX REPLACE "^firmware/" "" include ${folder})
  string(MD5 digits ${folder})
  string(SUBSTRING ${digits} 0 5 digits)
  get_property(other GLOBAL PROPERTY VERGENCE_LINK_${digits})
  if(other)
    message(FATAL_ERROR "${folder} and ${other} have the same include link: use more digits")
  endif()
  set_property(GLOBAL PROPERTY VERGENCE_LINK_${digits} ${folder})
  set(root ${PROJECT_BINARY_DIR}/i/${digits})
  cmake_path(GET include PARENT_PATH parent)
  file(MAKE_DIRECTORY ${root}/${parent})
  if(NOT EXISTS ${root}/${include})
    file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${root}/${include} SYMBOLIC)
  endif()
  target_include_directories(${target} ${scope} ${root})
  set(known NO)
  foreach(line ${vergence_arrows})
    if(line MATCHES "^${folder}:(.*)$")
      set(known YES)
      separate_arguments(allowed UNIX_COMMAND "${CMAKE_MATCH_1}")
      foreach(other ${allowed})
        if(other MATCHES "^fpga/")
          target_include_directories(${target} ${scope} ${PROJECT_SOURCE_DIR}/${other})
        else()
          vergence_target(${other} library)
          target_link_libraries(${target} ${scope} ${library})
        endif()
      endforeach()
    endif()
  endforeach()
  if(NOT known)
    message(FATAL_ERROR "tools/arrows.txt does not name ${folder}")
  endif()
endfunction()

# vergence_together(TARGET...): compiles several files of a folder at once, where the headers that they
# share (Eigen, JSON, YAML) take longer than what is theirs. Names without linkage are then unique in the
# folder.
function(vergence_together)
  set_target_properties(${ARGN} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
endfunction()

# vergence_embed(TARGET NAME|FILE... ...): texts that travel inside the program, each the string NAME
# (`extern const char *const NAME`), made of files below the present folder.
function(vergence_embed target)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${target}_texts.c)
  set(inputs)
  foreach(text IN LISTS ARGN)
    string(REPLACE "|" ";" files ${text})
    list(POP_FRONT files)
    list(APPEND inputs ${files})
  endforeach()
  add_custom_command(OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} "-DTEXTS=${ARGN}"
            -P ${PROJECT_SOURCE_DIR}/tools/embed.cmake
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}
    DEPENDS ${inputs} ${PROJECT_SOURCE_DIR}/tools/embed.cmake VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
