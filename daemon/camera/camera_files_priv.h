/* The backend for cameras that record by themselves: a watched folder, or a memory card that comes and goes. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_FILES_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_FILES_PRIV_H

#include "daemon/camera/camera_priv.h"

#include <time.h>

/* ---- what has been taken from a folder, kept while the program runs: a card that was pulled comes back ---- */

struct files_memory; /* of one folder; used under a lock of its own */
/* The one of this folder; made if there is none. Lives until the program ends. NULL: no memory. */
struct files_memory *files_memory_of(const char *folder);
bool files_memory_has(struct files_memory *memory, uint64_t key);
bool files_memory_add(struct files_memory *memory, uint64_t key); /* false: no memory */
void files_memory_remove(struct files_memory *memory, uint64_t key);
void files_memory_clear(struct files_memory *memory);
/* Armed: what is there already has been decided on; a new arming after this was unset decides again. */
bool files_memory_armed(struct files_memory *memory);
void files_memory_set_armed(struct files_memory *memory, bool armed);
/* Whose card this is: the first body's serial number that its files gave. False: it is another's. */
bool files_memory_is_of(struct files_memory *memory, const char *serial);
void files_memory_forget_all(void); /* tests */

/* ---- the files that are there, in order ---- */

struct files_item {
    char *path; /* below the folder */
    int64_t size, mtime_ns;
    int64_t changed_ns; /* when it was last seen to change, by the clock that files_watch_scan is given */
    uint64_t key;       /* of path, size and time */
    bool checked;       /* its end was looked at: `whole` */
    bool whole;
};
#define FILES_MATES 64
struct files_watch {
    char folder[256];
    int depth;         /* folders below it, at most */
    int64_t settle_ns; /* unchanged for so long: its writer is done */
    struct files_memory *memory;
    uint64_t device; /* st_dev of the folder: another is mounted there, or none any more */
    struct files_item *items;
    size_t count;
    struct {
        uint64_t stem;
        int64_t mtime_ns;
    } mates[FILES_MATES]; /* the latest that were taken: a raw file and its JPEG are one picture */
    unsigned mate;
};
int files_watch_init(struct files_watch *watch, const char *folder, struct lumi_error *error);
void files_watch_finish(struct files_watch *watch);
/* Looks at the folder. LUMI_ERR_IO: it is gone. */
int files_watch_scan(struct files_watch *watch, int64_t now_ns, struct lumi_error *error);
/* What is there now shall not be taken. */
int files_watch_skip(struct files_watch *watch, struct lumi_error *error);
/* The next file, whole and in order; it counts as taken from now on. False: none. Valid until the next scan. */
bool files_watch_next(struct files_watch *watch, int64_t now_ns, struct files_item **item);
/* The number that a camera gave the file: the last digits before its extension; 0: none. */
uint64_t files_number(const char *path);

#endif
