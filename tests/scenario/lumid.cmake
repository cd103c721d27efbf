add_test(NAME lumid_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/lumid_test.sh $<TARGET_FILE:lumid> $<TARGET_FILE:lumi>)
set_tests_properties(lumid_test PROPERTIES TIMEOUT 600)
lumi_sanitized(lumid_test)
# Its cameras are folders that files appear in.
add_test(NAME lumid_files_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/lumid_files_test.sh $<TARGET_FILE:lumid>
  $<TARGET_FILE:lumi>)
set_tests_properties(lumid_files_test PROPERTIES TIMEOUT 600)
add_test(NAME access_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/access_test.sh $<TARGET_FILE:lumid> $<TARGET_FILE:lumi>)
set_tests_properties(access_test PROPERTIES TIMEOUT 300)
