/* The flashed bytes on the emulated board, measured: instructions of every interrupt, and how fast it steps.
 * usage: bench_board IMAGE */
#include "proto/mechanism/kinematics.h"
#include "sim/board/board_client.h"
#include "tests/scenario/board_interrupts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* 100,000 steps a second at a speed the simulated motor follows. */
#define MICROSTEPS 256

static void fail(const char *what, const struct lumi_error *error, struct f405_machine *machine)
{
    const char *fault = f405_fault(f405_machine_chip(machine));
    fprintf(stderr, "bench_board: %s: %s%s%s\n", what, error->text, fault ? "; " : "", fault ? fault : "");
    exit(1);
}

/* The shortest distance of two steps, and how uneven neighbours in the middle half are, in cycles. */
static void measure_steps(struct f405_machine *machine, double *rate, double *uneven, int *steps)
{
    int count;
    const struct f405_machine_edge *edge = f405_machine_steps(machine, &count);
    uint64_t least = UINT64_MAX;
    *uneven = 0;
    for (int i = 1; i < count; i++)
        least = edge[i].at - edge[i - 1].at < least ? edge[i].at - edge[i - 1].at : least;
    for (int i = count * 2 / 5; i < count * 3 / 5; i++)
        *uneven = fmax(*uneven, fabs((double)(edge[i + 1].at - edge[i].at) - (double)(edge[i].at - edge[i - 1].at)));
    *rate = count > 1 ? (double)F405_HZ / (double)least : 0;
    *steps = count;
}

static int rest(struct board_client *client, double seconds, lumi_wire_Status *status, struct lumi_error *error)
{
    for (double t = 0; t < seconds; t += 0.1) {
        LUMI_TRY(board_client_run(client, 0.1, error));
        LUMI_TRY(board_client_status(client, status, error));
        if (status->state != lumi_wire_State_JOGGING)
            return LUMI_OK;
    }
    return lumi_fail(error, LUMI_ERR_IO, "the jog does not end");
}

static void step_rates(struct f405_machine *machine, struct board_client *client, const struct lumi_rig *rig)
{
    static const double rates[] = {2000, 5000, 10000, 20000, 40000, 70000, 99000};
    struct lumi_error error = {0};
    double per_turn = lumi_rig_steps_per_turn(rig);
    printf("\n%12s %12s %9s %10s %12s %10s  %s\n", "wanted /s", "reached /s", "steps", "uneven ns", "CPU in cruise",
           "TIM2 most", "");
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++) {
        lumi_wire_Request request = {.which_command = lumi_wire_Request_jog_tag};
        lumi_wire_Status status = {0};
        double rate, uneven;
        int steps;
        request.command.jog.turns = (i & 1 ? -1 : 1) * fmin(0.25, rates[i] * 0.5 / per_turn);
        request.command.jog.speed = rates[i] / per_turn * 2 * LUMI_PI;
        f405_machine_forget_edges(machine);
        f405_clear_stats(f405_machine_chip(machine));
        uint64_t instructions = f405_instructions(f405_machine_chip(machine)), at = f405_machine_now(machine);
        if (board_client_request(client, &request, NULL, &error) != LUMI_OK) {
            printf("%12.0f refused: %s\n", rates[i], error.text);
            continue;
        }
        board_client_run(client, 0.4, &error);
        double busy = (double)(f405_instructions(f405_machine_chip(machine)) - instructions) /
                      (double)(f405_machine_now(machine) - at);
        if (rest(client, 20, &status, &error) != LUMI_OK) {
            printf("%12.0f %s\n", rates[i], error.text);
            continue;
        }
        measure_steps(machine, &rate, &uneven, &steps);
        printf("%12.0f %12.0f %9d %10.0f %11.0f%% %10u  %s\n", rates[i], rate, steps, uneven / 0.168, busy * 100,
               f405_stats(f405_machine_chip(machine), 44)->instructions_max, status.faults ? "faults" : "");
    }
}

int main(int count, char **argument)
{
    struct sim_mechanics_options options;
    struct lumi_error error = {0};
    struct lumi_rig rig;
    if (count != 2) {
        fprintf(stderr, "usage: bench_board IMAGE\n");
        return 2;
    }
    if (lumi_rig_builtin("arc16", &rig, &error) != LUMI_OK)
        return 1;
    rig.microsteps = MICROSTEPS;
    rig.control.motion.step_pulse = 2e-6;
    rig.control.motion.speed_max = 99900 / lumi_rig_steps_per_turn(&rig) * 2 * LUMI_PI;
    rig.control.motion.home_speed = rig.control.motion.wind_speed = rig.control.motion.speed_max * 0.03;
    if (lumi_rig_check(&rig, &error) != LUMI_OK) {
        fprintf(stderr, "bench_board: %s\n", error.text);
        return 1;
    }
    sim_mechanics_options_init(&options, &rig);
    options.start_turns = -0.003;
    struct f405_machine *machine = f405_machine_create(&rig, &options);
    if (!machine || f405_machine_flash(machine, argument[1], &error) != LUMI_OK) {
        fprintf(stderr, "bench_board: %s\n", machine ? error.text : "no machine");
        return 1;
    }
    f405_machine_power(machine, true);
    struct board_client *client = board_client_create(machine, BOARD_LINK_USB);
    if (!client || board_client_configure(client, &rig, &error) != LUMI_OK)
        fail("configure", &error, machine);
    f405_clear_stats(f405_machine_chip(machine));
    if (board_client_home(client, false, 0, &error) != LUMI_OK)
        fail("home", &error, machine);
    printf("%.0f steps a turn; homing, over USB:\n", lumi_rig_steps_per_turn(&rig));
    board_print_interrupts(f405_machine_chip(machine));
    step_rates(machine, client, &rig);
    board_client_destroy(client);
    f405_machine_destroy(machine);
    return 0;
}
