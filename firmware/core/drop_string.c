/* The brake and the holding current: never neither of them. */
#include "firmware/core/core_state.h"

static void set_brake(struct core *core, bool open)
{
    struct drop_string *s = &core->string;

    if (s->open == open)
        return;
    s->open = open;
    s->brake_at = core->board->now(core->board->port);
    core->board->output(core->board->port, BOARD_OUT_BRAKE, open);
}

static void set_enabled(struct core *core, bool enabled)
{
    struct drop_string *s = &core->string;

    s->off_wanted = false;
    if (s->enabled == enabled)
        return;
    s->enabled = enabled;
    s->enabled_at = core->board->now(core->board->port);
    core->board->output(core->board->port, BOARD_OUT_ENABLE, enabled);
    if (!enabled)
        motion_forget(&core->motion); /* a platform without current can be turned by hand */
}

bool drop_string_held(const struct core *core)
{
    const struct drop_string *s = &core->string;

    if (!core->has_profile)
        return false;
    if (core->rig.string.held && !core->rig.control.safety.brake_fitted)
        return true;
    return core->rig.control.safety.brake_fitted && !s->open &&
           core->board->now(core->board->port) >= s->brake_at + DROP_STRING_BRAKE_TICKS;
}

/* After a reset the brake is closed (it closes without power). A watchdog's reset may have let go of the motor: it
 * holds again at once, whatever the profile says. */
void drop_string_init(struct core *core)
{
    const uint64_t now = core->board->now(core->board->port);

    core->string = (struct drop_string){.brake_at = now, .rest_at = now, .resting = true};
    core->board->output(core->board->port, BOARD_OUT_BRAKE, false);
    core->string.enabled = true;
    core->string.enabled_at = now;
    core->board->output(core->board->port, BOARD_OUT_ENABLE, true);
}

void drop_string_configure(struct core *core)
{
    set_enabled(core, true);
    set_brake(core, false);
}

static bool brake_opens(const struct core *core)
{
    return core->rig.control.safety.brake_fitted && !core->rig.string.held;
}

bool drop_string_ready(struct core *core)
{
    struct drop_string *s = &core->string;
    const uint64_t now = core->board->now(core->board->port);

    s->resting = false;
    set_enabled(core, true);
    if (!brake_opens(core)) {
        set_brake(core, false); /* somebody may have opened it by hand */
        return now >= s->enabled_at + DROP_STRING_BRAKE_TICKS && now >= s->brake_at + DROP_STRING_BRAKE_TICKS;
    }
    if (now < s->enabled_at + DROP_STRING_BRAKE_TICKS)
        return false; /* the current builds up first */
    set_brake(core, true);
    return now >= s->brake_at + DROP_STRING_BRAKE_TICKS;
}

void drop_string_close(struct core *core)
{
    set_brake(core, false);
}

void drop_string_release(struct core *core)
{
    set_brake(core, false);
    core->string.off_wanted = true;
    if (drop_string_held(core))
        set_enabled(core, false);
}

void drop_string_cut(struct core *core)
{
    set_brake(core, false);
    core->string.enabled = false;
    core->board->output(core->board->port, BOARD_OUT_ENABLE, false); /* the interrupt may have done so already */
    motion_forget(&core->motion);
}

bool drop_string_set_enable(struct core *core, bool active)
{
    if (!active && !drop_string_held(core))
        return false;
    set_enabled(core, active);
    return true;
}

bool drop_string_set_brake(struct core *core, bool open)
{
    if (open && (!core->string.enabled || !core->has_profile || !core->rig.control.safety.brake_fitted))
        return false;
    set_brake(core, open);
    core->string.resting = false; /* it stays as it was put until something has moved */
    return true;
}

void drop_string_poll(struct core *core)
{
    struct drop_string *s = &core->string;
    const uint64_t now = core->now;

    if (s->off_wanted && drop_string_held(core))
        set_enabled(core, false);
    if (!state_at_rest(core->state)) {
        s->rest_at = now;
        s->resting = true;
    } else if (s->resting && s->open && !(core_external(core) && s->enabled) &&
               now >= s->rest_at + DROP_STRING_REST_TICKS) {
        set_brake(core, false);
        s->resting = false;
    }
}

uint64_t drop_string_next_poll(const struct core *core)
{
    const struct drop_string *s = &core->string;
    uint64_t next = BOARD_NEVER;

    if (s->off_wanted && !s->open)
        next = s->brake_at + DROP_STRING_BRAKE_TICKS;
    if (state_at_rest(core->state) && s->resting && s->open && s->rest_at + DROP_STRING_REST_TICKS < next)
        next = s->rest_at + DROP_STRING_REST_TICKS;
    return next;
}
