lumi_fuzz(fuzz_plan FOLDERS mechanism base)
lumi_fuzz(fuzz_profile_store FOLDERS firmware_core wire mechanism base)
