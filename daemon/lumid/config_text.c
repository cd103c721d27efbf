/* The commented file and the manual page, from the table. */
#include "daemon/lumid/config_keys.h"
#include "proto/base/memory.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define TEXT_MAX 65536

struct text {
    char *data;
    size_t used;
};

static void say(struct text *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(struct text *text, const char *format, ...)
{
    va_list list;

    va_start(list, format);
    if (text->used < TEXT_MAX)
        text->used += (size_t)vsnprintf(text->data + text->used, TEXT_MAX - text->used, format, list);
    va_end(list);
}

/* Breaks it into comment lines of at most 100 characters. */
static void say_comment(struct text *text, const char *words)
{
    size_t column = 0;

    for (const char *word = words; *word;) {
        size_t length = strcspn(word, " ");
        if (column == 0 || column + 1 + length > 100) {
            say(text, "%s# ", column ? "\n" : "");
            column = 2;
        } else {
            say(text, " ");
            column++;
        }
        say(text, "%.*s", (int)length, word);
        column += length;
        word += length + (word[length] == ' ');
    }
    say(text, "\n");
}

char *lumi_config_print(void)
{
    struct text text = {lumi_alloc(1, TEXT_MAX), 0};
    char bounds[256], line[1024];

    if (!text.data)
        return NULL;
    say(&text, "# lumid's configuration, lumid.conf(5). What is commented out shows the default, or an example where\n"
               "# there is none. lumid --check says whether this file can be used.\n");
    for (const struct lumi_config_group *group = lumi_config_groups; group->name; group++) {
        bool camera = strcmp(group->name, "camera") == 0;
        say(&text, "\n");
        say_comment(&text, group->meaning);
        say(&text, camera ? "#[camera c00]\n" : "[%s]\n", group->name);
        for (int i = 0; i < lumi_config_key_count; i++) {
            const struct lumi_config_key *key = &lumi_config_keys[i];
            if (strcmp(key->group, group->name) != 0)
                continue;
            lumi_config_bounds(key, bounds, sizeof bounds);
            snprintf(line, sizeof line, *bounds ? "%s (%s)" : "%s", key->meaning, bounds);
            say_comment(&text, line);
            say(&text, "#%s = %s\n", key->name, *key->standard ? key->standard : key->example);
        }
    }
    return text.data;
}

/* Backslashes, hyphens and leading dots mean something to troff. */
static void say_troff(struct text *text, const char *words)
{
    if (*words == '.' || *words == '\'')
        say(text, "\\&");
    for (; *words; words++)
        if (*words == '-')
            say(text, "\\-");
        else if (*words == '\\')
            say(text, "\\e");
        else
            say(text, "%c", *words);
}

static void say_key(struct text *text, const struct lumi_config_key *key)
{
    char bounds[256];

    lumi_config_bounds(key, bounds, sizeof bounds);
    say(text, ".TP\n.B ");
    say_troff(text, key->name);
    say(text, "\n");
    say_troff(text, key->meaning);
    if (*bounds) {
        say(text, " Values: ");
        say_troff(text, bounds);
        say(text, ".");
    }
    if (*key->standard) {
        say(text, " Default: ");
        say_troff(text, key->standard);
    } else {
        say(text, " Example: ");
        say_troff(text, key->example);
    }
    say(text, "\n");
}

char *lumi_config_manual(void)
{
    struct text text = {lumi_alloc(1, TEXT_MAX), 0};

    if (!text.data)
        return NULL;
    say(&text,
        ".TH LUMID.CONF 5 \"\" \"lumisphere %s\" \"Lumisphere\"\n.SH NAME\nlumid.conf \\- configuration of lumid\n"
        ".SH SYNOPSIS\n/etc/lumisphere/lumid.conf\n.SH DESCRIPTION\n"
        "One file of groups, [GROUP], and keys, KEY = VALUE, one a line. Lines that begin with # or ; are "
        "comments. A group or key that is not named here, one that comes twice, and a value that cannot be are "
        "refused, each with the file's name and the line; lumid then ends with status 3.\n.PP\n"
        "lumid \\-\\-print\\-config writes a file with all keys; lumid \\-\\-check checks one.\n",
        LUMI_VERSION);
    for (const struct lumi_config_group *group = lumi_config_groups; group->name; group++) {
        say(&text, ".SH \"[%s%s]\"\n", group->name, strcmp(group->name, "camera") == 0 ? " NAME" : "");
        say_troff(&text, group->meaning);
        say(&text, "\n");
        for (int i = 0; i < lumi_config_key_count; i++)
            if (strcmp(lumi_config_keys[i].group, group->name) == 0)
                say_key(&text, &lumi_config_keys[i]);
    }
    say(&text, ".SH SEE ALSO\n.BR lumid (8),\n.BR lumi (1)\n");
    return text.data;
}
