lumi_fuzz(fuzz_image FOLDERS image base)
lumi_fuzz(fuzz_transforms FOLDERS exchange)
lumi_fuzz(fuzz_colmap FOLDERS exchange)
lumi_fuzz(fuzz_stanford FOLDERS exchange)
