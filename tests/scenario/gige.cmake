# Cameras over the real GigE Vision protocol, in a network namespace of their own; skipped where none can be had.
lumi_test(gige_cameras FOLDERS camera sim_gige sim base)
set_tests_properties(gige_cameras PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
lumi_sanitized(gige_cameras)
if(TARGET lumid)
  # And the whole chain: simulated rig, daemon, processing.
  add_test(NAME sim_rig_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/sim_rig_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid>)
  set_tests_properties(sim_rig_test PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 900)
  # An industrial drive, and what goes wrong, through the processes.
  foreach(name sim_rig_drive_test sim_rig_faults_test)
    add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/${name}.sh $<TARGET_FILE:lumi> $<TARGET_FILE:lumid>)
    set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
  endforeach()
  set_tests_properties(sim_rig_faults_test PROPERTIES LABELS slow)
  lumi_sanitized(sim_rig_drive_test)
  # What the cameras see, while nothing is under way and in a sweep.
  add_executable(watch_pictures watch_pictures.c)
  target_link_libraries(watch_pictures PRIVATE lumi_flags lumi_image lumi_base PkgConfig::libsoup_3_0)
  add_test(NAME rig_pictures_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/rig_pictures_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid> $<TARGET_FILE:watch_pictures>)
  set_tests_properties(rig_pictures_test PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 600)
  # Many who only listen.
  add_executable(hold_streams hold_streams.c)
  target_link_libraries(hold_streams PRIVATE lumi_flags PkgConfig::libsoup_3_0 PkgConfig::json_glib_1_0)
  add_test(NAME idle_streams_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/idle_streams_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid> $<TARGET_FILE:hold_streams>)
  set_tests_properties(idle_streams_test PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 LABELS "slow;long")
  lumi_first(sim_rig_test sim_rig_faults_test rig_pictures_test)
  # The daemon killed in the middle of its work; a hundred times only in `script/test all`.
  add_executable(capture_kept capture_kept.c)
  target_link_libraries(capture_kept PRIVATE lumi_flags lumi_capture lumi_base)
  set(kill_test ${CMAKE_CURRENT_SOURCE_DIR}/lumid_kill_test.sh $<TARGET_FILE:lumi> $<TARGET_FILE:lumid>
    $<TARGET_FILE:capture_kept>)
  set(kills 10)
  if(LUMI_SANITIZE)
    set(kills 5)
  endif()
  add_test(NAME lumid_kill_test COMMAND ${kill_test} ${kills})
  add_test(NAME lumid_kill_many COMMAND ${kill_test} 100)
  set_tests_properties(lumid_kill_test PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600)
  lumi_sanitized(lumid_kill_test)
  set_tests_properties(lumid_kill_many PROPERTIES SKIP_RETURN_CODE 77 LABELS "slow;long" TIMEOUT 3000)
  # Both in one folder.
  set_tests_properties(lumid_kill_test lumid_kill_many PROPERTIES RESOURCE_LOCK lumid_kill)
endif()
