lumi_test(test_camera_pictures FOLDERS preview camera image base LABELS threads)
