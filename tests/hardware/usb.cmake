# The real kernel on the emulated board's USB: only in `script/test all`.
pkg_check_modules(libusb-1.0 IMPORTED_TARGET GLOBAL libusb-1.0)
if(TARGET lumi_sim_board AND libusbredirparser-0.5_FOUND AND libusb-1.0_FOUND AND NOT LUMI_SANITIZE)
  add_executable(board_redir board_redir.c)
  target_link_libraries(board_redir PRIVATE lumi_flags lumi_sim_board lumi_sim_rig)
  add_executable(usb_hello usb_hello.c)
  target_link_libraries(usb_hello PRIVATE lumi_flags lumi_wire_messages lumi_wire lumi_mechanism lumi_base
    PkgConfig::libusb-1.0)
  add_test(NAME usb_vm COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/usb_vm.sh $<TARGET_FILE:board_redir>
    $<TARGET_FILE:usb_hello> ${LUMI_FIRMWARE}/lumirig.bin ${PROJECT_SOURCE_DIR}/build/third-party/debian)
else()
  add_test(NAME usb_vm COMMAND sh -c "echo 'skipped: Unicorn, libusbredirparser or libusb is missing'; exit 77")
endif()
set_tests_properties(usb_vm PROPERTIES SKIP_RETURN_CODE 77 LABELS "long;slow" TIMEOUT 900)
