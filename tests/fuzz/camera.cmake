lumi_fuzz(fuzz_camera FOLDERS camera)
