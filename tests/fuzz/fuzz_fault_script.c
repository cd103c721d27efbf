/* The parser of fault scripts. What it takes must be printable and parse again to the same faults. */
#include "checks.h"

#include "sim/rig/faults.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct sim_fault_script script, back;
    static char text[SIM_FAULTS_MAX * 256];
    struct lumi_error error = {0};

    if (checked(sim_fault_script_parse((const char *)data, size, "fuzz", &script, &error), &error) != LUMI_OK)
        return 0;
    size_t length = sim_fault_script_print(&script, text, sizeof text);
    if (length >= sizeof text || sim_fault_script_parse(text, length, "fuzz", &back, NULL) != LUMI_OK ||
        back.count != script.count ||
        memcmp(script.faults, back.faults, (size_t)script.count * sizeof script.faults[0]))
        abort();
    return 0;
}
