# The emulated board's core by a program of its own; skipped where Unicorn or the cross compiler is
# missing.
find_program(LUMI_ARM_GCC arm-none-eabi-gcc)
if(TARGET lumi_sim_board AND LUMI_ARM_GCC)
  set(core ${CMAKE_CURRENT_SOURCE_DIR}/core)
  set(image ${CMAKE_CURRENT_BINARY_DIR}/exceptions)
  add_custom_command(OUTPUT ${image}.bin
    COMMAND ${LUMI_ARM_GCC} -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -O1 -ffreestanding -nostdlib
      -Wall -Wextra -Wl,--build-id=none -T ${core}/exceptions.ld ${core}/exceptions.c -o ${image}.elf
    COMMAND arm-none-eabi-objcopy -O binary ${image}.elf ${image}.bin
    DEPENDS ${core}/exceptions.c ${core}/exceptions.ld VERBATIM)
  lumi_test(board_core FOLDERS sim_board sim_rig LABELS slow)
  target_sources(board_core PRIVATE ${image}.bin)
  target_compile_definitions(board_core PRIVATE BOARD_CORE_IMAGE="${image}.bin")
else()
  add_test(NAME board_core COMMAND sh -c "echo 'skipped: libunicorn-dev or arm-none-eabi-gcc is missing'; exit 77")
  set_tests_properties(board_core PROPERTIES SKIP_RETURN_CODE 77 LABELS slow)
endif()
