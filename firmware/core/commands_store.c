/* The commands that give and take: plan, profile, the shots' states. */
#include "firmware/core/core_state.h"
#include "proto/base/bytes.h"

#include <string.h>

static void refuse_with_error(struct core *core, lumi_wire_Result result, lumi_wire_Reply *reply)
{
    core_refuse(reply, result, core->error.text);
}

/* The same plan again keeps what was done of it: a host that comes back may well load it anew. */
void core_command_load_plan(struct core *core, const lumi_wire_LoadPlan *load, lumi_wire_Reply *reply)
{
    struct lumi_plan plan;

    if (core_refuse_unless_rest(core, reply))
        return;
    if (!core->has_profile) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "load: the board has no profile");
        return;
    }
    if (!load->has_plan || lumi_wire_to_plan(&load->plan, &plan, &core->error) != LUMI_OK ||
        lumi_plan_check(&plan, &core->rig, &core->error) != LUMI_OK) {
        if (!load->has_plan)
            core_refuse(reply, lumi_wire_Result_BAD, "load: no plan is in the message");
        else
            refuse_with_error(core, lumi_wire_Result_BAD, reply);
        return;
    }
    uint32_t crc = lumi_wire_plan_crc(&plan);
    if (core->has_plan && crc == core->plan_crc)
        return;
    core->plan = plan;
    core->plan_crc = crc;
    core->has_plan = true;
    firing_plan_again(&core->firing, 0, LUMI_PLAN_SHOTS_MAX);
    core->sweep = (struct sweep){.active = false};
}

void core_command_read_plan(struct core *core, lumi_wire_Reply *reply)
{
    if (!core->has_plan) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "no plan is loaded");
        return;
    }
    reply->which_payload = lumi_wire_Reply_plan_tag;
    lumi_wire_from_plan(&core->plan, &reply->payload.plan);
}

/* As it lies in flash, behind the store's header. */
void core_command_read_profile(struct core *core, const lumi_wire_ReadProfile *read, lumi_wire_Reply *reply)
{
    lumi_wire_ProfilePart *part = &reply->payload.profile;

    if (!core->has_profile) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "the board has no profile");
        return;
    }
    if (read->offset > core->profile.size) {
        core_refuse(reply, lumi_wire_Result_BAD, "beyond the profile's end");
        return;
    }
    uint32_t size = core->profile.size - read->offset;
    part->offset = read->offset;
    part->size = core->profile.size;
    part->crc = core->profile.crc;
    part->data.size = (pb_size_t)(size < sizeof part->data.bytes ? size : sizeof part->data.bytes);
    memcpy(part->data.bytes, profile_store_data(core->board, &core->profile) + read->offset, part->data.size);
    reply->which_payload = lumi_wire_Reply_profile_tag;
}

void core_command_write_profile(struct core *core, const lumi_wire_WriteProfile *write, lumi_wire_Reply *reply)
{
    if (write->offset == 0)
        core->uploaded = 0;
    if (write->offset != core->uploaded) {
        core_refuse(reply, lumi_wire_Result_BAD, "the profile comes in order");
        return;
    }
    if (write->data.size > sizeof core->store.data - core->uploaded) {
        core_refuse(reply, lumi_wire_Result_BAD, "the profile is too long");
        return;
    }
    memcpy(core->store.data + core->uploaded, write->data.bytes, write->data.size);
    core->uploaded += write->data.size;
}

void core_command_commit_profile(struct core *core, const lumi_wire_CommitProfile *commit, lumi_wire_Reply *reply)
{
    if (core_refuse_unless_rest(core, reply))
        return;
    if (core->safety.standing != 0) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "not while a fault stands");
        return;
    }
    if (firing_busy_now(&core->firing)) {
        core_refuse(reply, lumi_wire_Result_REFUSED,
                    "not while a trigger is up"); /* their edges lie where it is read */
        return;
    }
    if (commit->size == 0 || commit->size != core->uploaded ||
        lumi_crc32c(0, core->store.data, core->uploaded) != commit->crc) {
        core_refuse(reply, lumi_wire_Result_BAD, "what has come is not the whole profile");
        return;
    }
    /* While flash is erased no interrupt comes through, not even the emergency stop's: nothing may move by itself. */
    if (core_external(core))
        drop_string_cut(core);
    /* Decoded into the board's own profile, for want of room for two; whatever comes of it, the one in flash that
     * counts is loaded afterwards. */
    if (lumi_wire_decode_profile(core->store.data, core->uploaded, &core->store.message, &core->rig, &core->error) !=
            LUMI_OK ||
        lumi_rig_check(&core->rig, &core->error) != LUMI_OK)
        refuse_with_error(core, lumi_wire_Result_BAD, reply);
    else if (profile_store_save(core->board, core->store.data, core->uploaded, commit->replace_newer, &core->error) !=
             LUMI_OK)
        refuse_with_error(core, lumi_wire_Result_FAILED, reply);
    core_load_profile(core);
}

void core_command_read_shots(struct core *core, const lumi_wire_ReadShots *read, lumi_wire_Reply *reply)
{
    lumi_wire_Shots *shots = &reply->payload.shots;
    uint32_t all = core->has_plan ? (uint32_t)lumi_plan_shots(&core->plan) : 0;

    if (read->first % 4 != 0 || read->first > all) {
        core_refuse(reply, lumi_wire_Result_BAD, "no such shot, or not a multiple of 4");
        return;
    }
    uint32_t count = all - read->first;
    if (count > sizeof shots->states.bytes * 4)
        count = sizeof shots->states.bytes * 4;
    shots->first = read->first;
    shots->count = count;
    shots->states.size = (pb_size_t)((count + 3) / 4);
    for (uint32_t i = 0; i < count; i++)
        shots->states.bytes[i / 4] |= (uint8_t)(firing_state(&core->firing, read->first + i) << i % 4 * 2);
    reply->which_payload = lumi_wire_Reply_shots_tag;
}

void core_command_mark_shots(struct core *core, const lumi_wire_MarkShots *mark, lumi_wire_Reply *reply)
{
    uint32_t all = core->has_plan ? (uint32_t)lumi_plan_shots(&core->plan) : 0;

    if (core_refuse_unless_rest(core, reply))
        return;
    if (mark->first > all || mark->count > all - mark->first) {
        core_refuse(reply, lumi_wire_Result_BAD, "no such shots in the plan");
        return;
    }
    firing_mark(&core->firing, mark->first, mark->count, mark->fired ? SHOT_FIRED : SHOT_PLANNED);
}
