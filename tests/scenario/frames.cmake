add_executable(make_dng make_dng.c)
target_link_libraries(make_dng PRIVATE lumi_flags lumi_camera)
add_test(NAME raw_process_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/raw_process_test.sh $<TARGET_FILE:lumi> $<TARGET_FILE:make_dng>)
set_tests_properties(raw_process_test PROPERTIES LABELS slow TIMEOUT 900)
