# A simulated rig behind a pseudo-terminal, and the program that a crew types at its other end.
add_executable(serve_rig serve_rig.c)
target_link_libraries(serve_rig PRIVATE lumi_sim_rig lumi_firmware_host lumi_firmware_core lumi_wire lumi_mechanism
  lumi_base lumi_flags)
add_test(NAME rig_run_test
  COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/rig_run_test.sh $<TARGET_FILE:lumi> $<TARGET_FILE:serve_rig>)
set_tests_properties(rig_run_test PROPERTIES TIMEOUT 600 LABELS slow)
lumi_test(rig_drive_core FOLDERS daemon_rig fake_drive firmware_host firmware_core wire mechanism base)
