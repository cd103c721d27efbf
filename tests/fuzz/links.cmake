lumi_fuzz(fuzz_drive_map FOLDERS daemon_rig base)
