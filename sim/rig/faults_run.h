/* A fault script at work on a machine. */
#ifndef LUMI_SIM_RIG_FAULTS_RUN_H
#define LUMI_SIM_RIG_FAULTS_RUN_H

#include "sim/rig/faults.h"
#include "sim/rig/machine.h"

struct sim_fault_run;

struct sim_fault_run *sim_fault_run_new(const struct sim_fault_script *script, uint64_t seed, uint64_t now);
void sim_fault_run_free(struct sim_fault_run *run);
uint64_t sim_fault_run_next(const struct sim_fault_run *run);
/* Does what is due. */
void sim_fault_run_poll(struct sim_fault_run *run, struct sim_machine *machine);

#endif
