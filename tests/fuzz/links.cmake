lumi_fuzz(fuzz_drive_map FOLDERS daemon_rig base)
lumi_fuzz(fuzz_board_image FOLDERS daemon_rig base)
