add_executable(golden_dump golden_dump.c)
target_link_libraries(golden_dump PRIVATE lumi_flags lumi_lightfield lumi_capture lumi_image lumi_base)
add_executable(golden_capture golden_capture.c)
target_link_libraries(golden_capture PRIVATE lumi_flags lumi_capture lumi_base)
add_test(NAME golden_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/golden_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:golden_dump> $<TARGET_FILE:golden_capture>)
