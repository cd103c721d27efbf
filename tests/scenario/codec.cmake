add_executable(damage_field damage_field.c)
target_include_directories(damage_field PRIVATE ${PROJECT_SOURCE_DIR}/tests/unit)
target_link_libraries(damage_field PRIVATE lumi_flags lumi_lightfield lumi_base)
add_test(NAME damage_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/damage_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:damage_field>)
