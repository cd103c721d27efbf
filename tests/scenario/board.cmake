# The flashed bytes on the emulated board; where Unicorn or the cross compiler is missing, they are skipped.
set(board_tests board_sweep board_usb)
foreach(name ${board_tests})
  if(TARGET lumi_sim_board)
    lumi_test(${name} FOLDERS sim_board sim_rig firmware_host firmware_core wire mechanism base LABELS slow)
    target_compile_definitions(${name} PRIVATE LUMI_FIRMWARE="${LUMI_FIRMWARE}")
  else()
    add_test(NAME ${name} COMMAND sh -c "echo 'skipped: libunicorn-dev is missing'; exit 77")
    set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 LABELS slow)
  endif()
endforeach()

# The same bytes behind a pseudo-terminal, driven by the program itself.
if(TARGET lumi_sim_board)
  add_executable(serve_board serve_board.c)
  target_link_libraries(serve_board PRIVATE lumi_flags lumi_sim_board lumi_sim_rig lumi_mechanism lumi_base)
  add_test(NAME board_line_test COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/board_line_test.sh $<TARGET_FILE:lumi>
    $<TARGET_FILE:serve_board> ${LUMI_FIRMWARE}/lumirig.bin)
  set_tests_properties(board_line_test PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 600)
endif()
