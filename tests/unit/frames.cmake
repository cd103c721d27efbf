lumi_test(test_frame_file FOLDERS camera image sim)
