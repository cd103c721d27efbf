# Cameras under the kernel's real drivers, in the virtual machine.
add_executable(camera_vivid camera_vivid.c)
target_link_libraries(camera_vivid PRIVATE lumi_flags lumi_camera)
lumi_vm(camera PROGRAMS camera_vivid)
