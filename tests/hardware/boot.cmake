# The virtual machine itself.
lumi_vm(boot)
