lumi_fuzz(fuzz_image FOLDERS image base)
