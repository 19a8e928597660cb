# SPDX-License-Identifier: Apache-2.0
# Debian packages, one per component: read by cpack (CPACK_PROJECT_CONFIG_FILE). tools/package sets
# CPACK_DEBIAN_PACKAGE_VERSION and SOURCE_DATE_EPOCH.
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL tools daemon simrig library development python)
# The Python module is a build of its own, of the folder $VERGENCE_PYTHON_BUILD.
set(python_build $ENV{VERGENCE_PYTHON_BUILD})
list(GET CPACK_INSTALL_CMAKE_PROJECTS 0 build)
list(APPEND CPACK_INSTALL_CMAKE_PROJECTS ${python_build} vergence_python ALL /)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${build}/library)
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/complete.cmake)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${CPACK_PACKAGE_CONTACT}")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(version "${CPACK_DEBIAN_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")

# The first line of each description is its summary.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")
set(about "Vergence is a stereo instrument with motorized zoom lenses: from two
images to a surface in mm, with a predicted deviation for every point.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME vergence)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "vergence-daemon, vergence-simrig")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "stereo measurement from two cameras
${about}

This package has the program: calibration, reconstruction,
evaluation, reports, live view.")

set(CPACK_DEBIAN_DAEMON_PACKAGE_NAME vergence-daemon)
set(CPACK_DEBIAN_DAEMON_PACKAGE_SECTION science)
set(CPACK_DEBIAN_DAEMON_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_DAEMON_PACKAGE_RECOMMENDS vergence)
set(CPACK_DEBIAN_DAEMON_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/postinst"
    "${CMAKE_CURRENT_LIST_DIR}/prerm" "${CMAKE_CURRENT_LIST_DIR}/postrm"
    "${CMAKE_CURRENT_LIST_DIR}/conffiles")
set(CPACK_DEBIAN_DAEMON_DESCRIPTION "daemon of the Vergence stereo instrument
${about}

This package has the daemon that runs the instrument, as a service with
its own user, and udev rules.")

set(CPACK_DEBIAN_SIMRIG_PACKAGE_NAME vergence-simrig)
set(CPACK_DEBIAN_SIMRIG_PACKAGE_SECTION science)
set(CPACK_DEBIAN_SIMRIG_PACKAGE_DEPENDS "python3, python3-numpy")
set(CPACK_DEBIAN_SIMRIG_DESCRIPTION "simulated rig of the Vergence stereo instrument
${about}

This package has the simulated rig: cameras, lenses and servos
behind the Verilog of the FPGA.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libvergence1)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/triggers")
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "stereo measurement from two cameras (library)
${about}

This package has the shared library.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libvergence-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libvergence1 (= ${version})")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "stereo measurement from two cameras (development files)
${about}

This package has the header, and the files for pkg-config and CMake.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-vergence)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "libvergence1 (= ${version}), $ENV{VERGENCE_PYTHON_DEPENDS}, python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-tqdm, python3-distributed")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${CMAKE_CURRENT_LIST_DIR}/python/postinst"
    "${CMAKE_CURRENT_LIST_DIR}/python/prerm")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "stereo measurement from two cameras (Python)
${about}

This package has the Python package vergence.")
