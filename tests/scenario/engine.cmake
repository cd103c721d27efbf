foreach(name slurm_test slurm_chain_test engine_chain_test)
  add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/${name}.sh $<TARGET_FILE:lumi>)
  set_tests_properties(${name} PROPERTIES LABELS "slow;long" SKIP_RETURN_CODE 77 TIMEOUT 1800)
endforeach()

add_executable(kill_resume kill_resume.c)
target_link_libraries(kill_resume PRIVATE lumi_flags)
add_test(NAME kill_resume_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/kill_resume_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:kill_resume>)
set_tests_properties(kill_resume_test PROPERTIES LABELS slow TIMEOUT 600)
add_test(NAME kill_resume_long_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/kill_resume_test.sh $<TARGET_FILE:lumi>
  $<TARGET_FILE:kill_resume> long)
set_tests_properties(kill_resume_long_test PROPERTIES LABELS "slow;long" TIMEOUT 3000)

add_test(NAME engine_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/engine_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(engine_test PROPERTIES LABELS slow TIMEOUT 600)
