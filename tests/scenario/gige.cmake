# Cameras over the real GigE Vision protocol, in a network namespace of their own; skipped where none can be had.
lumi_test(gige_cameras FOLDERS camera sim_gige sim base)
set_tests_properties(gige_cameras PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 300)
# And the whole chain: simulated rig, daemon, processing.
if(TARGET lumid)
  add_test(NAME sim_rig_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/sim_rig_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid>)
  set_tests_properties(sim_rig_test PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 900)
  # An industrial drive, and what goes wrong, through the processes.
  foreach(name sim_rig_drive_test sim_rig_faults_test)
    add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/${name}.sh $<TARGET_FILE:lumi> $<TARGET_FILE:lumid>)
    set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 600)
  endforeach()
endif()
