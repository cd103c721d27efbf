lumi_fuzz(fuzz_wire_frame FOLDERS wire)
lumi_fuzz(fuzz_wire_server FOLDERS wire)
lumi_fuzz(fuzz_wire_client FOLDERS wire)
lumi_fuzz(fuzz_wire_profile FOLDERS wire mechanism base)
