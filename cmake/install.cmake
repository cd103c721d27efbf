# liblumi: the part of the house that runs inside other people's programs (proto/base, proto/lightfield, render), as one
# library, shared and static, with its headers, a pkg-config file and a CMake package (find_package(lumi), lumi::lumi).
set(LUMI_LIBRARY_FOLDERS proto/base proto/lightfield render/viewset render/cpu)

set(objects "")
set(headers "")
foreach(path ${LUMI_LIBRARY_FOLDERS})
  get_filename_component(name ${path} NAME)
  get_target_property(type lumi_${name} TYPE)
  if(NOT type STREQUAL INTERFACE_LIBRARY)
    list(APPEND objects $<TARGET_OBJECTS:lumi_${name}>)
  endif()
  file(GLOB found CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/${path}/*.h)
  list(FILTER found EXCLUDE REGEX "_priv\\.h$")
  install(FILES ${found} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lumisphere/${path})
  list(APPEND headers ${found})
endforeach()
list(JOIN headers "\n" lines)
file(CONFIGURE OUTPUT generated/installed_headers.txt CONTENT "${lines}\n")

add_library(lumi_shared SHARED ${objects})
add_library(lumi_static STATIC ${objects})
foreach(target lumi_shared lumi_static)
  set_target_properties(${target} PROPERTIES OUTPUT_NAME lumi LINKER_LANGUAGE C)
  target_link_libraries(${target} PRIVATE PkgConfig::vpx Threads::Threads m)
  target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/lumisphere>)
endforeach()
if(LUMI_SANITIZE)
  target_link_options(lumi_shared PRIVATE -fsanitize=${LUMI_SANITIZE})
endif()
set_target_properties(lumi_shared PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR} EXPORT_NAME
  lumi)
target_link_options(lumi_shared PRIVATE LINKER:--version-script=${PROJECT_SOURCE_DIR}/cmake/liblumi.map)
set_property(TARGET lumi_shared APPEND PROPERTY LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/liblumi.map)

install(TARGETS lumi_shared lumi_static EXPORT lumi
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
set(cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lumi)
install(EXPORT lumi NAMESPACE lumi:: DESTINATION ${cmake_dir} FILE lumi-targets.cmake)
include(CMakePackageConfigHelpers)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/lumi-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/lumi-config.cmake
  ${PROJECT_BINARY_DIR}/generated/lumi-config-version.cmake DESTINATION ${cmake_dir})
file(RELATIVE_PATH up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /) # the package may be put anywhere
configure_file(${PROJECT_SOURCE_DIR}/cmake/lumi.pc.in ${PROJECT_BINARY_DIR}/generated/lumi.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/generated/lumi.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
