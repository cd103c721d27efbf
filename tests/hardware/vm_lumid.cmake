# lumid under the real drivers.
add_dependencies(lumi_hardware lumid)
if(TARGET board_redir AND TARGET uvc_device)
  lumi_vm(lumid LABELS long)
  lumi_vm(lumid_power LABELS long TIMEOUT 3600)
  if(TEST vm_lumid)
    set_tests_properties(vm_lumid vm_lumid_power PROPERTIES ENVIRONMENT
      "LUMI_BOARD_REDIR=$<TARGET_FILE:board_redir>;LUMI_IMAGE=${LUMI_FIRMWARE}/lumirig.bin;LUMI_UVC_DEVICE=$<TARGET_FILE:uvc_device>")
  endif()
endif()
