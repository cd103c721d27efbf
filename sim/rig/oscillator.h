/* A damped oscillator about a place that is moved in jumps: exact at any time, however long the step. */
#ifndef LUMI_SIM_RIG_OSCILLATOR_H
#define LUMI_SIM_RIG_OSCILLATOR_H

/* x'' = −ω² (x − u) − 2 ζ ω (x' − u'); `y` is x − u, `v` is x' where u stands still. Damping acts on the speed against
 * u, so that what is carried along at constant speed does not lag. */
struct sim_oscillator {
    double y, v;
};
/* u jumps by `by`: x stays, and the damper pulls once (the integral of 2 ζ ω u' over the jump). */
void sim_oscillator_jump(struct sim_oscillator *oscillator, double by, double omega, double zeta);
/* u stands still for `dt` seconds. */
void sim_oscillator_advance(struct sim_oscillator *oscillator, double dt, double omega, double zeta);
/* How far it gets from rest at most, from now on, without damping. */
double sim_oscillator_envelope(const struct sim_oscillator *oscillator, double omega);

#endif
