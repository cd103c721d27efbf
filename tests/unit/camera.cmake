add_library(lumi_fake_camera STATIC fake_camera.c)
target_link_libraries(lumi_fake_camera PUBLIC lumi_camera lumi_flags)
lumi_test(test_camera_host FOLDERS camera fake_camera LABELS threads)
lumi_test(test_camera FOLDERS camera)
