add_test(NAME slurm_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/slurm_test.sh $<TARGET_FILE:lumi>)
set_tests_properties(slurm_test PROPERTIES LABELS "slow;long" SKIP_RETURN_CODE 77 TIMEOUT 600)
