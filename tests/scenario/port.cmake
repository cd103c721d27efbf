# The port alone on the emulated board.
if(TARGET lumi_sim_board)
  lumi_test(test_port FOLDERS sim_board LABELS slow)
  target_compile_definitions(test_port PRIVATE LUMI_FIRMWARE="${LUMI_FIRMWARE}")
endif()
