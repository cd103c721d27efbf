/* How long jerk-limited motion takes. Linked into firmware: no stdio. */
#include "proto/mechanism/ramp_time.h"

#include <math.h>

double lumi_ramp_time(double speed, double acceleration, double jerk)
{
    if (speed * jerk < acceleration * acceleration)
        return 2 * sqrt(speed / jerk);
    return speed / acceleration + acceleration / jerk;
}

double lumi_ramp_distance(double speed, double acceleration, double jerk)
{
    return speed / 2 * lumi_ramp_time(speed, acceleration, jerk);
}

double lumi_move_speed(double distance, double speed, double acceleration, double jerk)
{
    /* Two ramps without a cruise: distance = v · ramp time(v). Without reaching the acceleration that is
     * 2 v^(3/2) / √j, else v² / a + v a / j. */
    double peak = cbrt(distance * distance * jerk / 4), rise = acceleration / jerk;

    if (peak * jerk > acceleration * acceleration)
        peak = acceleration / 2 * (sqrt(rise * rise + 4 * distance / acceleration) - rise);
    return fmin(peak, speed);
}

double lumi_move_time(double distance, double speed, double acceleration, double jerk)
{
    double reached = lumi_move_speed(distance, speed, acceleration, jerk);
    double ramp = lumi_ramp_time(reached, acceleration, jerk);

    return 2 * ramp + fmax(distance - reached * ramp, 0) / reached;
}

double lumi_ramp_slowest_step(double speed, double acceleration, double jerk)
{
    return cbrt(6 / jerk) + sqrt(2 / acceleration) + 1 / speed;
}
