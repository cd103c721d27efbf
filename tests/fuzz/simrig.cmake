lumi_fuzz(fuzz_fault_script FOLDERS sim_rig)
