# The image for the board: size, what may not be in it, worst-case stack, header, the same bytes from anywhere.
if(NOT LUMI_SANITIZE AND NOT LUMI_FUZZ)
  set(firmware_check ${CMAKE_CURRENT_SOURCE_DIR}/firmware.sh)
  lumi_house(firmware_stack_seen ${CMAKE_CURRENT_SOURCE_DIR}/firmware_stack_test.sh ${CMAKE_CURRENT_SOURCE_DIR})
  foreach(check size symbols stack)
    lumi_house(firmware_${check} ${firmware_check} ${check} ${PROJECT_SOURCE_DIR} "${LUMI_FIRMWARE}")
  endforeach()
  lumi_house(firmware_header ${firmware_check} header ${PROJECT_SOURCE_DIR} "${LUMI_FIRMWARE}"
    $<TARGET_FILE:lumi_image_seal>)
  lumi_house(firmware_same ${firmware_check} same ${PROJECT_SOURCE_DIR} "${LUMI_FIRMWARE}"
    $<TARGET_FILE:lumi_image_seal> ${PROJECT_SOURCE_DIR}/build/third-party/nanopb ${PROJECT_BINARY_DIR}/generated
    ${PROJECT_VERSION})
endif()
