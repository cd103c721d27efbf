/* The options that say where a run runs. */
#include "cli/engine_options.h"

#include "cli/command.h"

#include <string.h>

struct engine_options engine_options = {.chunk = -1, .retries = -1, .every = 5};

static int check_number(const char *name, int value, int least, int most, struct lumi_error *error)
{
    if (value >= least && value <= most)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_ARG, "%s %d: %d to %d wanted", name, value, least, most);
}

static int take_slurm(struct lumi_record *record, struct lumi_error *error)
{
    for (char **option = engine_options.slurm; option && *option; option++) {
        if (!(*option)[0] || (*option)[0] == '-' || (*option)[0] == '=')
            return lumi_fail(error, LUMI_ERR_ARG, "--slurm %s: NAME=VALUE wanted, as sbatch takes it without its --",
                             *option);
        if (option == engine_options.slurm)
            g_ptr_array_set_size(record->options, 0);
        g_ptr_array_add(record->options, g_strdup(*option));
    }
    return LUMI_OK;
}

int engine_options_read(struct lumi_record *record, struct lumi_error *error)
{
    static const char *const engines[] = {"local", "slurm", NULL};
    const struct engine_options *o = &engine_options;
    int choice;

    if (o->engine) {
        LUMI_TRY(cli_parse_choice("--engine", o->engine, engines, &choice, error));
        record->engine = (enum lumi_engine)choice;
    }
    if (o->chunk != -1) {
        LUMI_TRY(check_number("--chunk", o->chunk, 1, 1000000, error));
        record->chunk = o->chunk;
    }
    if (o->retries != -1) {
        LUMI_TRY(check_number("--retries", o->retries, 0, 100, error));
        record->retries = o->retries;
    }
    LUMI_TRY(check_number("--every", o->every, 1, 3600, error));
    if (record->engine == LUMI_ENGINE_LOCAL && (o->slurm || o->chunk != -1 || o->command || o->no_wait))
        return lumi_fail(error, LUMI_ERR_ARG, "%s is for --engine slurm",
                         o->slurm         ? "--slurm"
                         : o->chunk != -1 ? "--chunk"
                         : o->command     ? "--command"
                                          : "--no-wait");
    return take_slurm(record, error);
}
