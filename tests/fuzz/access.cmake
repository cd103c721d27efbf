lumi_fuzz(fuzz_access FOLDERS access base)
