/* The table of lumid.conf: what keys there are, and how one value is read. */
#ifndef LUMI_DAEMON_LUMID_CONFIG_KEYS_H
#define LUMI_DAEMON_LUMID_CONFIG_KEYS_H

#include "daemon/lumid/config.h"

enum lumi_config_kind {
    LUMI_CONFIG_TEXT = 0, /* char[bytes] */
    LUMI_CONFIG_PLACE,    /* char[bytes]: a path from the root */
    LUMI_CONFIG_LINK,     /* char[bytes]: a board's address */
    LUMI_CONFIG_CAMERA,   /* char[bytes]: a camera's */
    LUMI_CONFIG_FLAG,     /* bool: yes, no */
    LUMI_CONFIG_NUMBER,   /* int */
    LUMI_CONFIG_REAL,     /* double */
    LUMI_CONFIG_BYTES,    /* size_t: 512M */
    LUMI_CONFIG_CHOICE,   /* an enum, by names */
    LUMI_CONFIG_LINE      /* a GPIO line with a role: CHIP:LINE[,active-low][,debounce_us=N] */
};

/* An enum's names in order, NULL-terminated. */
extern const char *const lumi_config_triggers[], *const lumi_config_layouts[];

struct lumi_config_key {
    const char *group, *name;
    enum lumi_config_kind kind;
    size_t offset, bytes; /* into struct lumi_config; of group "camera": into struct lumi_engine_camera */
    double least, most;
    const char *const *names;
    enum lumi_gpio_role role;
    const char *standard; /* the default, as text; "": none */
    const char *example;  /* where the default is "" */
    const char *meaning;
};
extern const struct lumi_config_key lumi_config_keys[];
extern const int lumi_config_key_count;

/* The groups in the order of the file, with what they are for; NULL-terminated pairs. "camera" is followed by a name.
 */
struct lumi_config_group {
    const char *name, *meaning;
};
extern const struct lumi_config_group lumi_config_groups[];

/* Reads `value` to where the key says in `base`; LINE: into *line. Returns NULL or what is wrong (in `why` or static).
 */
const char *lumi_config_read(const struct lumi_config_key *key, const char *value, void *base,
                             struct lumi_gpio_line *line, char *why, size_t size);
/* "0..10", "yes or no", "free, hardware, software": what a value may be; "" where there is nothing to say. */
void lumi_config_bounds(const struct lumi_config_key *key, char *text, size_t size);

#endif
