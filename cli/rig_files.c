/* Rig profiles and plans from the command line. */
#include "cli/rig_files.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <string.h>

int cli_read_rig(const char *name, struct lumi_rig *rig, struct lumi_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    int code = lumi_file_read(name, LUMI_RIG_TEXT_MAX, &text, &size, error);

    if (code == LUMI_OK)
        code = lumi_rig_parse((const char *)text, size, name, rig, error);
    else if (code == LUMI_ERR_NOTFOUND)
        for (int i = 0; lumi_rig_builtin_names[i]; i++)
            if (!strcmp(name, lumi_rig_builtin_names[i]))
                code = lumi_rig_builtin(name, rig, error);
    lumi_free(text);
    return code;
}

int cli_read_plan(const char *path, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    int code = lumi_file_read(path, LUMI_PLAN_TEXT_MAX, &text, &size, error);

    if (code == LUMI_OK)
        code = lumi_plan_parse((const char *)text, size, path, rig, plan, error);
    lumi_free(text);
    return code;
}
