add_executable(qemu_hello qemu_hello.c)
target_link_libraries(qemu_hello PRIVATE lumi_flags lumi_wire_messages lumi_wire lumi_mechanism lumi_base)
add_test(NAME qemu_board
  COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/qemu_board.sh $<TARGET_FILE:qemu_hello> ${LUMI_FIRMWARE}/lumirig-qemu.elf)
set_tests_properties(qemu_board PROPERTIES SKIP_RETURN_CODE 77 LABELS slow TIMEOUT 300)
