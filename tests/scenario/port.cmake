# The port alone on the emulated board; skipped as board_sweep is.
if(TARGET lumi_sim_board)
  lumi_test(test_port FOLDERS sim_board LABELS slow)
  target_compile_definitions(test_port PRIVATE LUMI_FIRMWARE="${LUMI_FIRMWARE}")
else()
  add_test(NAME test_port COMMAND sh -c "echo 'skipped: libunicorn-dev is missing'; exit 77")
  set_tests_properties(test_port PROPERTIES SKIP_RETURN_CODE 77 LABELS slow)
endif()
