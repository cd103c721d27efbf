add_executable(make_capture make_capture.c)
target_link_libraries(make_capture PRIVATE lumi_flags lumi_capture lumi_mechanism lumi_base)
add_test(NAME verify_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/verify_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:make_capture>)
