lumi_test(test_image FOLDERS image base)
lumi_test(test_image_damage FOLDERS image base)
