if(LUMI_SANITIZE)
  add_test(NAME sanitized_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/sanitized_test.sh $<TARGET_FILE:lumi>
    ${CMAKE_CURRENT_SOURCE_DIR}/threads.supp)
  set_tests_properties(sanitized_test PROPERTIES LABELS threads TIMEOUT 1500)
endif()
