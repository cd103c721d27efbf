add_executable(serve_api serve_api.c)
target_link_libraries(serve_api PRIVATE lumi_engine_double lumi_http lumi_flags)
add_test(NAME capture_command_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/capture_command_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:serve_api>)
