add_executable(compare_views compare_views.c)
target_link_libraries(compare_views PRIVATE lumi_flags lumi_image lumi_base)
add_test(NAME poles_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/poles_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:compare_views>)
set_tests_properties(poles_test PROPERTIES LABELS slow TIMEOUT 900)
