/* The parser of plans. What it takes must be printable, parse again to the same numbers, and have sound totals. The
 * first byte picks the rig. */
#include "checks.h"

#include "proto/mechanism/sweep_plan.h"

#include <math.h>

static void use(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    int shots = lumi_plan_shots(plan), positions = plan->positions * plan->turns;
    double seconds = lumi_plan_seconds(plan, rig), blur = lumi_plan_blur(plan, rig);

    if (shots < 0 || shots > LUMI_PLAN_SHOTS_MAX || lumi_plan_frames(plan, rig) < shots || !(seconds > 0) ||
        !isfinite(seconds) || !(blur >= 0) || !isfinite(blur))
        abort();
    if (lumi_plan_position_step(plan, rig, positions - 1) < lumi_plan_position_step(plan, rig, 0) ||
        !(lumi_plan_run_up(plan, rig) > 0) || !(lumi_plan_run_down(plan, rig) > 0))
        abort();
    for (int k = 0; k < plan->bracket; k++)
        if (!(lumi_plan_exposure_spacing(plan, rig, k) >= plan->exposures[k]))
            abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char text[LUMI_PLAN_TEXT_MAX];
    struct lumi_error error = {0};
    struct lumi_plan plan, back;
    struct lumi_rig rig;

    if (size == 0 || lumi_rig_builtin(lumi_rig_builtin_names[data[0] % 3], &rig, NULL) != LUMI_OK)
        return 0;
    if (data[0] & 0x40) { /* wirings and drives that the built-in rigs do not have */
        rig.control.triggers[0].channel = -1;
        rig.control.motion.drive = data[0] & 0x80 ? LUMI_RIG_DRIVE_EXTERNAL : LUMI_RIG_DRIVE_STEPPER;
    }
    const int as_text = checked(lumi_plan_check_text((const char *)data + 1, size - 1, "fuzz", &error), &error);
    if (checked(lumi_plan_parse((const char *)data + 1, size - 1, "fuzz", &rig, &plan, &error), &error) != LUMI_OK)
        return 0;
    if (as_text != LUMI_OK) /* a rig asks more of a plan, never less */
        abort();
    size_t length = lumi_plan_print(&plan, &rig, text, sizeof text);
    if (length >= sizeof text || lumi_plan_parse(text, length, "fuzz", &rig, &back, NULL) != LUMI_OK ||
        memcmp(&plan, &back, sizeof plan) != 0)
        abort();
    use(&plan, &rig);
    return 0;
}
