lumi_test(test_spread FOLDERS subsample run capture image lightfield base)
