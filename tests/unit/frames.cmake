lumi_test(test_frame_file FOLDERS camera image sim)
lumi_test(test_camera_files FOLDERS camera image LABELS threads)
lumi_test(test_judge FOLDERS judge sim)
