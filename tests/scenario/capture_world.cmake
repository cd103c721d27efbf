# The capture engine in a whole simulated world.
set(world_uses lumi_flags lumi_store lumi_judge lumi_camera lumi_daemon_rig lumi_capture lumi_image lumi_sim_rig
  lumi_firmware_host lumi_firmware_core lumi_wire lumi_mechanism lumi_base)
add_library(capture_world STATIC capture_world.c world_board.c world_cameras.c world_frames.c world_disk.c world_ack.c
  world_script.c capture_operator.c capture_truth.c)
target_link_libraries(capture_world PUBLIC ${world_uses})

lumi_test(capture_sweeps FOLDERS engine)
target_link_libraries(capture_sweeps PRIVATE capture_world lumi_engine)

# Five hundred bad days; under sanitizers fewer, more only in `script/test all`.
lumi_test(capture_faults FOLDERS engine)
target_link_libraries(capture_faults PRIVATE capture_world lumi_engine)
if(LUMI_SANITIZE STREQUAL thread)
  set_tests_properties(capture_faults PROPERTIES ENVIRONMENT LUMI_FAULTS_COUNT=20)
elseif(LUMI_SANITIZE)
  set_tests_properties(capture_faults PROPERTIES ENVIRONMENT LUMI_FAULTS_COUNT=60)
endif()
lumi_sanitized(capture_sweeps capture_faults)
add_test(NAME capture_faults_many COMMAND capture_faults 5000 1001)
set_tests_properties(capture_faults_many PROPERTIES LABELS "long;slow" TIMEOUT 3000)

lumi_test(capture_soak FOLDERS engine LABELS slow)
target_link_libraries(capture_soak PRIVATE capture_world lumi_engine)

# The engine in a process of its own, which is killed.
add_executable(capture_engine_process capture_engine_process.c remote_socket.c)
target_link_libraries(capture_engine_process PRIVATE lumi_engine lumi_store lumi_flags)
add_executable(capture_kill capture_kill.c remote_engine.c remote_socket.c)
target_link_libraries(capture_kill PRIVATE capture_world lumi_engine lumi_flags PkgConfig::cmocka lumi_test_filter)
add_test(NAME capture_kill COMMAND capture_kill $<TARGET_FILE:capture_engine_process>)
set_tests_properties(capture_kill PROPERTIES TIMEOUT 600)
