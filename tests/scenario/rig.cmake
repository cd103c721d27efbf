lumi_test(rig_sweeps FOLDERS sim_rig firmware_host firmware_core wire mechanism base)
lumi_test(rig_video FOLDERS sim_rig firmware_host firmware_core wire mechanism base)
lumi_test(rig_faults FOLDERS sim_rig firmware_host firmware_core wire mechanism base)
target_sources(rig_faults PRIVATE rig_operator.c)
