lumi_test(rig_sweeps FOLDERS sim_rig firmware_host firmware_core wire mechanism base)
lumi_test(rig_video FOLDERS sim_rig firmware_host firmware_core wire mechanism base)
