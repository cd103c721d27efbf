add_test(NAME calibrate_lens_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/calibrate_lens_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(calibrate_lens_test PROPERTIES SKIP_RETURN_CODE 77)
