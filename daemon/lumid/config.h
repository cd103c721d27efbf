/* lumid's configuration: one key file (docs/lumid.md, lumid.conf(5)), read into what the parts want. The table of keys
 * is in config_keys.c; defaults, checks, the commented file and the manual page all come from it. No clock, no
 * hardware: what the file says is checked against itself, lumi_config_check_host asks the machine. */
#ifndef LUMI_DAEMON_LUMID_CONFIG_H
#define LUMI_DAEMON_LUMID_CONFIG_H

#include "daemon/engine/engine.h"

#define LUMI_CONFIG_PATH 1024
#define LUMI_CONFIG_SIZE (256 * 1024) /* of a file, at most */

struct lumi_config {
    struct lumi_engine_config engine; /* store.second_copy stays NULL: `second_copy` below */
    char second_copy[LUMI_CONFIG_PATH];
    /* [rig] */
    char link[256];                   /* as for lumi_rig_link_open */
    char drive[256];                  /* as for lumi_rig_drive_open; "": the board turns the platform */
    char drive_map[LUMI_CONFIG_PATH]; /* its registers, docs/rig-drive.md */
    /* [gpio], and sync and power of [camera NAME] */
    struct lumi_gpio_line gpio[LUMI_GPIO_LINES];
    int gpio_count;
    /* [judge] */
    int judge_workers; /* threads; 0: by the number of processors */
    /* [http] */
    char listen[256];
    char token_file[LUMI_CONFIG_PATH], certificate[LUMI_CONFIG_PATH], key[LUMI_CONFIG_PATH];
    size_t body_max;
    char access[LUMI_CONFIG_PATH]; /* "": no users */
    char secure[256];              /* "": never */
    double session_idle, session_most;
    /* [preview] */
    char preview[LUMI_CONFIG_PATH]; /* the command; "": none */
    /* [process] */
    char command[LUMI_CONFIG_PATH];
    int process_parallel, process_retries;
    /* [ingest] */
    char ingest_folder[LUMI_CONFIG_PATH];
    double ingest_settle;
};

/* What an empty file means. */
void lumi_config_init(struct lumi_config *config);

/* One wrong thing each: "FILE:LINE: [GROUP] KEY: what is wrong with it". */
typedef void (*lumi_config_problem_fn)(void *context, const char *text);
/* Reads all of it, telling every wrong thing to `problem` (may be NULL). LUMI_ERR_FORMAT where there was one; `error`
 * has the first and how many there are. `source` is the file's name, for messages. */
int lumi_config_parse(const char *text, size_t size, const char *source, struct lumi_config *config,
                      lumi_config_problem_fn problem, void *context, struct lumi_error *error);
int lumi_config_load(const char *path, struct lumi_config *config, lumi_config_problem_fn problem, void *context,
                     struct lumi_error *error);
/* Whether the files and folders it names are there and can be used: LUMI_ERR_NOTFOUND, LUMI_ERR_IO, …; all of them told
 * to `problem`. `source` as above. */
int lumi_config_check_host(const struct lumi_config *config, const char *source, lumi_config_problem_fn problem,
                           void *context, struct lumi_error *error);

/* A whole file with every key, its meaning, its bounds and its default, commented out; or the manual page
 * lumid.conf(5). Allocated; release with lumi_free. NULL: out of memory. */
char *lumi_config_print(void);
char *lumi_config_manual(void);

#endif
