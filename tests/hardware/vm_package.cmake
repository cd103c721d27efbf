# The Debian package, as Debian 13 makes it, under systemd.
set(deb ${PROJECT_BINARY_DIR}/package/made)
add_custom_command(OUTPUT ${deb}
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${PROJECT_BINARY_DIR}/package
  COMMAND ${CMAKE_CPACK_COMMAND} -G DEB -B ${PROJECT_BINARY_DIR}/package
  COMMAND ${CMAKE_COMMAND} -E touch ${deb}
  DEPENDS lumi lumid lumi_shared lumi_static manual lumid_manual ${PROJECT_SOURCE_DIR}/daemon/lumid/lumid.service
    ${PROJECT_SOURCE_DIR}/cmake/package/postinst ${PROJECT_SOURCE_DIR}/cmake/package/prerm
    ${PROJECT_SOURCE_DIR}/cmake/package/postrm
  WORKING_DIRECTORY ${PROJECT_BINARY_DIR} VERBATIM)
add_custom_target(debian_package DEPENDS ${deb})
if(TARGET board_redir AND TARGET uvc_device)
  lumi_vm(package PROGRAMS debian_package WORDS lumi.init=systemd LABELS long)
  if(TEST vm_package)
    set_tests_properties(vm_package PROPERTIES ENVIRONMENT
      "LUMI_BOARD_REDIR=$<TARGET_FILE:board_redir>;LUMI_IMAGE=${LUMI_FIRMWARE}/lumirig.bin;LUMI_UVC_DEVICE=$<TARGET_FILE:uvc_device>")
  endif()
else()
  add_dependencies(lumi_hardware debian_package)
endif()
