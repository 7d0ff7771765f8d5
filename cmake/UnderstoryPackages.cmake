# Debian packages, one for each component of install(): deploy/package makes them.
set(UNDERSTORY_PACKAGE_VERSION "${PROJECT_VERSION}" CACHE STRING "Version of the Debian packages, without revision")
set(packaging "${CMAKE_SOURCE_DIR}/deploy/packaging")
set(staged "${CMAKE_BINARY_DIR}/packaging")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME understory)
set(CPACK_PACKAGE_VERSION "${UNDERSTORY_PACKAGE_VERSION}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # Each package has its own.
set(CPACK_PACKAGE_VENDOR "The Understory authors")
set(CPACK_PACKAGE_CONTACT "$ENV{UNDERSTORY_MAINTAINER}")
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX "${CMAKE_INSTALL_PREFIX}")
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)

# understory_package(COMPONENT PACKAGE SECTION SUMMARY TEXT [DEPENDS ...] [RECOMMENDS ...] [SUGGESTS ...] [ALL])
# Manual pages, changelog and licence are what deploy/package puts into packaging/PACKAGE of the build.
macro(understory_package component package section summary text)
  cmake_parse_arguments(ARG "ALL" "" "DEPENDS;RECOMMENDS;SUGGESTS" ${ARGN})
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  install(DIRECTORY "${staged}/${package}/" DESTINATION . COMPONENT ${component} OPTIONAL)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${text}")
  foreach(field DEPENDS RECOMMENDS SUGGESTS)
    list(JOIN ARG_${field} ", " CPACK_DEBIAN_${upper}_PACKAGE_${field})
  endforeach()
  if(ARG_ALL)
    set(CPACK_DEBIAN_${upper}_PACKAGE_ARCHITECTURE all)
  endif()
  file(GLOB scripts CONFIGURE_DEPENDS "${packaging}/${package}/*")
  set(CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${scripts}")
endmacro()

set(same "(= ${UNDERSTORY_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(about "Understory gives a ground vehicle its pose and a map of landmarks that all\nlook alike (tree trunks, house corners) where satellite navigation is blocked.")
understory_package(runtime understory science
  "localisation and mapping among landmarks that all look alike"
  "${about}\n\nThe processes of the vehicle, the command understory, the page that shows\na drive, and a systemd unit. As installed, the unit drives a simulated vehicle."
  # OpenBLAS in one thread: what the results are measured with.
  DEPENDS adduser libopenblas0-serial RECOMMENDS "python3-understory ${same}" SUGGESTS understory-eval liblcm-bin)
understory_package(eval understory-eval science
  "experiments with Understory: tables, results, plots"
  "${about}\n\nThe experiments: simulated and recorded drives, scored against ground truth\nand beside published figures (understory eval)."
  DEPENDS "understory ${same}" RECOMMENDS python3-matplotlib)
understory_package(python python3-understory python
  "logs, live bus and maps of Understory for Python"
  "${about}\n\nThe Python package: logs, the live bus and stored maps without an LCM\nlibrary; poses, maps and errors as arrays; a drive as one HTML file."
  ALL DEPENDS python3:any python3-numpy RECOMMENDS python3-matplotlib)
understory_package(existence libunderstory-existence-dev libdevel
  "existence probability of map points (C++ library)"
  "Which parts of an old map are still true: a model of the existence of map\npoints for any SLAM by keypoints. It needs Eigen alone; BSD licence."
  DEPENDS "libeigen3-dev (>= 3.4)")
understory_package(dev libunderstory-dev libdevel
  "localisation and mapping among landmarks (C++ libraries)"
  "${about}\n\nHeaders, static libraries and find_package(understory) for programs that use\nthe libraries, or are processes on the bus."
  DEPENDS "libunderstory-existence-dev ${same}" libboost-dev libbz2-dev libcgal-dev libcli11-dev libeigen3-dev libfmt-dev
  liblcm-dev liblz4-dev liblzf-dev libnanoflann-dev libpcap-dev libproj-dev libspdlog-dev libsqlite3-dev libssl-dev
  libsuitesparse-dev libtomlplusplus-dev libzip-dev libzstd-dev nlohmann-json3-dev zlib1g-dev)

# dpkg asks before it replaces a file that somebody has changed.
file(GLOB_RECURSE settings RELATIVE "${CMAKE_SOURCE_DIR}/deploy/config" CONFIGURE_DEPENDS "${CMAKE_SOURCE_DIR}/deploy/config/*.toml")
list(TRANSFORM settings PREPEND /etc/understory/)
list(APPEND settings /etc/default/understory)
list(JOIN settings "\n" conffiles)
file(CONFIGURE OUTPUT "${staged}/conffiles" CONTENT "@conffiles@\n" @ONLY)
list(APPEND CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA "${staged}/conffiles")
include(CPack)
