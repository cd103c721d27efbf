lumi_fuzz(fuzz_handover FOLDERS handover base)
