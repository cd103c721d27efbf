lumi_fuzz(fuzz_places FOLDERS run base)
