# Cameras under the kernel's real drivers, in the virtual machine.
add_executable(camera_vivid camera_vivid.c)
target_link_libraries(camera_vivid PRIVATE lumi_flags lumi_camera)
pkg_check_modules(libjpeg REQUIRED IMPORTED_TARGET GLOBAL libjpeg)
add_executable(camera_uvc camera_uvc.c)
target_link_libraries(camera_uvc PRIVATE lumi_flags lumi_camera PkgConfig::libjpeg)
lumi_vm(camera PROGRAMS camera_vivid camera_uvc)

# The USB camera itself, on this side.
pkg_check_modules(libusbredirparser-0.5 IMPORTED_TARGET GLOBAL libusbredirparser-0.5)
if(libusbredirparser-0.5_FOUND)
  add_executable(uvc_device uvc_device.c)
  target_link_libraries(uvc_device PRIVATE lumi_flags PkgConfig::libjpeg PkgConfig::libusbredirparser-0.5)
  if(TEST vm_camera)
    set_tests_properties(vm_camera PROPERTIES ENVIRONMENT "LUMI_UVC_DEVICE=$<TARGET_FILE:uvc_device>")
  endif()
endif()
