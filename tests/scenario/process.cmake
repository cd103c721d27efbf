add_test(NAME process_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/process_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(process_test PROPERTIES LABELS slow TIMEOUT 900)
