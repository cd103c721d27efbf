add_executable(preview_rows preview_rows.c)
target_link_libraries(preview_rows PRIVATE lumi_pipeline_preview lumi_evaluate lumi_flags)
add_test(NAME preview_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/preview_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:preview_rows>)
set_tests_properties(preview_test PROPERTIES TIMEOUT 600 LABELS slow)
if(TARGET lumid)
  add_executable(ask_view ask_view.c)
  target_link_libraries(ask_view PRIVATE lumi_flags lumi_image lumi_base PkgConfig::libsoup_3_0 PkgConfig::json_glib_1_0)
  add_test(NAME rig_field_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/rig_field_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:lumid> $<TARGET_FILE:ask_view>)
  set_tests_properties(rig_field_test PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 600 LABELS slow)
  lumi_first(rig_field_test)
endif()
