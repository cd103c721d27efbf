foreach(test frame session refusals events message profile torture)
  lumi_test(test_wire_${test} FOLDERS wire)
endforeach()
