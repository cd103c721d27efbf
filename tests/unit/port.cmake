# The port's own lumi_fail beside the host's, under another name.
lumi_test(test_board_text FOLDERS base)
target_sources(test_board_text PRIVATE ${PROJECT_SOURCE_DIR}/firmware/stm32f405/freestanding.c)
set_source_files_properties(${PROJECT_SOURCE_DIR}/firmware/stm32f405/freestanding.c PROPERTIES
  COMPILE_DEFINITIONS lumi_fail=board_fail)
