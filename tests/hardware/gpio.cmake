# The kernel's simulated GPIO chip, through libgpiod 2.
add_executable(gpio_chip gpio_chip.c)
target_link_libraries(gpio_chip PRIVATE lumi_flags lumi_gpio lumi_base)
lumi_vm(gpio PROGRAMS gpio_chip)
