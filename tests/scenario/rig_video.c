/* A video sweep: cameras record by themselves, and the lamp they see tells every turn's frames apart. */
#include "firmware/core/lamp.h"
#include "rig_fixture.h"

struct frames {
    const struct sim_video_frame *all;
    int count;
    int *of; /* places in `all` of one camera's frames, in order */
    int own;
};

static struct frames frames_of(struct rig_fixture *f, int camera)
{
    struct frames frames = {0};

    frames.all = sim_mechanics_video(sim_machine_mechanics(f->machine), &frames.count);
    frames.of = calloc((size_t)frames.count + 1, sizeof frames.of[0]);
    for (int i = 0; i < frames.count; i++)
        if (frames.all[i].camera == camera)
            frames.of[frames.own++] = i;
    return frames;
}

static const struct sim_video_frame *frame(const struct frames *frames, int k)
{
    return &frames->all[frames->of[k]];
}

/* As a program that has only the pictures: where the lamp comes on after it was dark for longer than a code is ever,
 * the code begins; each half bit is read in its middle. Returns the number, or −1 where it does not check. */
static int decode(const struct frames *frames, int at, double half_frames)
{
    unsigned word = 0;
    uint64_t bits = 0;

    for (int h = 0; h < LAMP_HALF_BITS; h++) {
        int k = at + (int)((h + 0.5) * half_frames);
        if (k >= frames->own)
            return -1;
        bits |= (uint64_t)frame(frames, k)->lamp << h;
    }
    for (int i = 0; i < 12; i++)
        word = word << 1 | (unsigned)(bits >> (1 + 2 * i) & 1);
    return lamp_code(word) == bits ? (int)word : -1;
}

static void check_camera(struct rig_fixture *f, int camera, double *worst)
{
    struct frames frames = frames_of(f, camera);
    const double rate = f->options.mechanics.video_rate, half = f->rig.control.video.lamp_bit / 2 * rate;
    const int quiet = (int)(3 * half);
    int dark = quiet, found = 0, first = 0, last = 0;

    for (int k = 0; k < frames.own; k++) {
        if (!frame(&frames, k)->lamp) {
            dark++;
            continue;
        }
        if (dark >= quiet && k > 0) {
            int turn = decode(&frames, k, half);
            assert_int_equal(turn, f->plan.first_turn + found);
            /* The mark lies between this frame and the one before. */
            double angle = (frame(&frames, k)->angle + frame(&frames, k - 1)->angle) / 2;
            double error = fabs(angle - lumi_rig_turn_angle(&f->rig, turn)) / DEGREE;
            *worst = fmax(*worst, error);
            if (found == 0)
                first = k;
            last = k;
            found++;
            k += (int)(LAMP_HALF_BITS * half);
        }
        dark = 0;
    }
    assert_int_equal(found, f->plan.turns + 1); /* the end of the last turn is marked too */
    /* Enough frames for a column at each of 72 positions, all of them within the recording. */
    assert_true(last - first >= 72 * f->plan.turns);
    assert_true(fabs((last - first) / rate - f->plan.turn_time * f->plan.turns) < 0.1);
    free(frames.of);
}

static void video(const char *rig, double turn_time, double record_pulse)
{
    struct rig_fixture f;
    double worst = 0;

    rig_fixture_init(&f, rig);
    f.plan.mode = LUMI_PLAN_VIDEO;
    f.plan.turn_time = turn_time;
    f.options.mechanics.video = true;
    f.rig.control.video.record_pulse = record_pulse;
    rig_fixture_start(&f);
    struct rig_figures figures = rig_fixture_sweep(&f);
    assert_int_equal(figures.exposures, 0);
    for (int camera = 0; camera < f.rig.camera_count; camera++)
        check_camera(&f, camera, &worst);
    /* Half a frame of turning, and what homing leaves. */
    double frame_angle = 360 / turn_time / f.options.mechanics.video_rate;
    print_message("%s video %g s: turn marks found within %.3f deg (a frame is %.3f)\n", rig, turn_time, worst,
                  frame_angle);
    assert_true(worst < frame_angle / 2 + 0.05);
    /* Nothing records any more. */
    int before, after;
    sim_mechanics_video(sim_machine_mechanics(f.machine), &before);
    sim_machine_run(f.machine, 5);
    sim_mechanics_video(sim_machine_mechanics(f.machine), &after);
    assert_int_equal(before, after);
    rig_fixture_finish(&f);
}

static void sixteen_rows_are_filmed_and_every_turn_is_found_by_its_code(void **state)
{
    (void)state;
    video("arc16", 30, 0.2);
    video("arc16", 60, 0.2);
    video("arc16", 120, 0.2);
}

static void thirty_two_rows_are_filmed_in_two_turns(void **state)
{
    (void)state;
    video("arc16x2", 30, 0.2);
    video("arc16x2", 60, 0.2);
    video("arc16x2", 120, 0.2);
}

static void cameras_that_record_while_their_line_is_held_are_filmed_with_too(void **state)
{
    (void)state;
    video("arc16", 30, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sixteen_rows_are_filmed_and_every_turn_is_found_by_its_code),
        cmocka_unit_test(thirty_two_rows_are_filmed_in_two_turns),
        cmocka_unit_test(cameras_that_record_while_their_line_is_held_are_filmed_with_too),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
