lumi_test(test_resources FOLDERS pipeline_engine)
lumi_test(test_slurm FOLDERS pipeline_engine)
