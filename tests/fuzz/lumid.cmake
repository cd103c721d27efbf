lumi_fuzz(fuzz_config FOLDERS lumid base)
