add_test(NAME prefilter_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/prefilter_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(prefilter_test PROPERTIES LABELS slow TIMEOUT 300)
