lumi_fuzz(fuzz_core FOLDERS firmware_host)
