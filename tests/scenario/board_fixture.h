/* What the scenarios of the emulated board share: a small rig around the bytes that are flashed. */
#ifndef LUMI_TESTS_SCENARIO_BOARD_FIXTURE_H
#define LUMI_TESTS_SCENARIO_BOARD_FIXTURE_H

#include "sim/board/board_client.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#define BOARD_OK(expression)                                                                                           \
    do {                                                                                                               \
        struct lumi_error board_error_ = {0};                                                                          \
        struct lumi_error *error = &board_error_;                                                                      \
        if ((expression) != LUMI_OK)                                                                                   \
            fail_msg("%s: %s", #expression, board_error_.text);                                                        \
    } while (0)

struct board_fixture {
    struct lumi_rig rig;
    struct lumi_plan plan;
    struct f405_machine *machine;
    struct board_client *client;
};

/* Image to run: the one that was built with this test, or the one the environment names. */
static inline const char *board_image(void)
{
    const char *image = getenv("LUMI_BOARD_IMAGE");
    return image ? image : LUMI_FIRMWARE "/lumirig.bin";
}

/* arc16 with few microsteps and two feedbacks, near its index mark, and a plan of 12 positions in 7 s: little to
 * emulate. */
static inline void board_fixture_init(struct board_fixture *f)
{
    struct sim_mechanics_options options;
    memset(f, 0, sizeof *f);
    BOARD_OK(lumi_rig_builtin("arc16", &f->rig, error));
    f->rig.microsteps = 4;
    f->rig.control.motion.home_speed = 0.5;
    f->rig.control.triggers[3].feedback = 0;
    f->rig.control.triggers[12].feedback = 3;
    BOARD_OK(lumi_rig_check(&f->rig, error));
    lumi_plan_init(&f->plan, &f->rig);
    f->plan.positions = 12;
    f->plan.turn_time = 7;
    f->plan.exposures[0] = 0.001;
    BOARD_OK(lumi_plan_check(&f->plan, &f->rig, error));
    sim_mechanics_options_init(&options, &f->rig);
    options.start_turns = -0.03;
    f->machine = f405_machine_create(&f->rig, &options);
    assert_non_null(f->machine);
    BOARD_OK(f405_machine_flash(f->machine, board_image(), error));
    f405_machine_power(f->machine, true);
}

static inline void board_fixture_connect(struct board_fixture *f, enum board_link link)
{
    f->client = board_client_create(f->machine, link);
    if (!f->client)
        fail_msg("no client: %s", f405_fault(f405_machine_chip(f->machine)));
    BOARD_OK(board_client_open(f->client, 3, error));
}

/* For a test that will fail: what the board has told. */
static inline void board_fixture_tell(struct board_fixture *f)
{
    int count;
    const lumi_wire_Event *event = board_client_events(f->client, &count);
    for (int i = 0; i < count; i++) {
        printf("%10.6f s event %u of kind %d", (double)event[i].time_ns * 1e-9, event[i].number, event[i].which_kind);
        if (event[i].which_kind == lumi_wire_Event_fault_tag)
            printf(": fault %u %s", event[i].kind.fault.fault, event[i].kind.fault.text);
        if (event[i].which_kind == lumi_wire_Event_state_changed_tag)
            printf(": state %d to %d", event[i].kind.state_changed.from, event[i].kind.state_changed.to);
        printf("\n");
    }
}

static inline lumi_wire_Status board_fixture_status(struct board_fixture *f)
{
    lumi_wire_Status status = {0};
    BOARD_OK(board_client_status(f->client, &status, error));
    return status;
}

static inline void board_fixture_finish(struct board_fixture *f)
{
    const char *fault = f405_fault(f405_machine_chip(f->machine));
    if (fault)
        fail_msg("%s", fault);
    board_client_destroy(f->client);
    f405_machine_destroy(f->machine);
}

/* Skips the program where there is no image. */
static inline int board_image_is_there(void)
{
    if (access(board_image(), R_OK) == 0)
        return 1;
    printf("skipped: no image of the firmware (%s): the cross compiler or nanopb's source is missing\n", board_image());
    return 0;
}

#endif
