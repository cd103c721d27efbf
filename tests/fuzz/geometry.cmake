lumi_fuzz(fuzz_mesh FOLDERS lightfield base)
