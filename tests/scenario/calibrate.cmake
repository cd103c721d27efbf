add_test(NAME bad_capture_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/bad_capture_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(bad_capture_test PROPERTIES LABELS slow TIMEOUT 600)
add_test(NAME bad_capture_all_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/bad_capture_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:make_films>)
set_tests_properties(bad_capture_all_test PROPERTIES LABELS "slow;long" TIMEOUT 1800)
