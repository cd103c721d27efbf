lumi_fuzz(fuzz_preview FOLDERS preview pipeline_preview base)
lumi_fuzz(fuzz_capture_copy FOLDERS capture mechanism base)
