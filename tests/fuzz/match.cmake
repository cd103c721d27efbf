lumi_fuzz(fuzz_features FOLDERS calibrate run base)
lumi_fuzz(fuzz_pairs FOLDERS calibrate run base)
lumi_fuzz(fuzz_masks FOLDERS calibrate run base)
