# The power goes while frames are stored.
add_executable(power_store power_store.c)
target_link_libraries(power_store PRIVATE lumi_flags lumi_store lumi_capture lumi_mechanism lumi_base)
lumi_vm(power PROGRAMS power_store LABELS long)
