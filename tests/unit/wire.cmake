foreach(test frame session refusals events message profile document torture)
  lumi_test(test_wire_${test} FOLDERS wire)
endforeach()
