lumi_fuzz(fuzz_api FOLDERS http base)
