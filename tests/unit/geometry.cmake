lumi_test(test_mesh FOLDERS lightfield base)
lumi_test(test_equiangular FOLDERS equiangular lightfield base)
lumi_test(test_simplify FOLDERS geometry lightfield base)
