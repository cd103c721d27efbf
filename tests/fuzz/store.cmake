lumi_fuzz(fuzz_capture FOLDERS capture mechanism base)
lumi_fuzz(fuzz_rig FOLDERS mechanism base)
