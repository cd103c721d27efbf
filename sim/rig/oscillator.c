/* The closed form of a damped oscillator: below, at and above critical damping. */
#include "sim/rig/oscillator.h"

#include <math.h>

void sim_oscillator_jump(struct sim_oscillator *oscillator, double by, double omega, double zeta)
{
    oscillator->y -= by;
    oscillator->v += 2 * zeta * omega * by;
}

void sim_oscillator_advance(struct sim_oscillator *oscillator, double dt, double omega, double zeta)
{
    double y = oscillator->y, v = oscillator->v, s = zeta * omega;
    double square = omega * omega * (1 - zeta * zeta), e, c, r;

    if (s * dt > 60) { /* nothing is left */
        oscillator->y = oscillator->v = 0;
        return;
    }
    e = exp(-s * dt);
    if (square > 1e-9 * omega * omega) {
        double d = sqrt(square);
        c = cos(d * dt);
        r = sin(d * dt) / d;
    } else if (square < -1e-9 * omega * omega) {
        double d = sqrt(-square);
        c = cosh(d * dt);
        r = sinh(d * dt) / d;
    } else {
        c = 1;
        r = dt;
    }
    oscillator->y = e * (y * c + (v + s * y) * r);
    oscillator->v = e * (v * c - (s * v + omega * omega * y) * r);
}

double sim_oscillator_envelope(const struct sim_oscillator *oscillator, double omega)
{
    return hypot(oscillator->y, oscillator->v / omega);
}
