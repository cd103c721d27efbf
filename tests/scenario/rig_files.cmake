add_test(NAME rig_files_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/rig_files_test.sh $<TARGET_FILE:lumi>)
