/* A new firmware for the board, through the loader in its chip (STMicroelectronics AN2606, AN3156) and dfu-util. */
#ifndef LUMI_DAEMON_RIG_FLASH_H
#define LUMI_DAEMON_RIG_FLASH_H

#include "daemon/rig/link.h"
#include "firmware/board/board_image.h"

#define LUMI_RIG_IMAGE_MAX (1u << 20)

/* Whether both are versions of the form 1.2.3, and `version` is before `other`. */
bool lumi_rig_version_older(const char *version, const char *other);

/* Checks an image (firmware/board/board_image.h): LUMI_ERR_FORMAT (none, or for another board than `board`, NULL for
 * any), LUMI_ERR_CHECKSUM, LUMI_ERR_VERSION. Its header goes to `image`, texts ended. */
int lumi_rig_image_check(const uint8_t *data, size_t size, const char *source, const char *board,
                         struct board_image *image, struct lumi_error *error);

struct lumi_rig_flash {
    struct lumi_rig_link *link; /* NULL: the board is in its loader already (its BOOT0 jumper) */
    const char *path;
    const char *program;    /* "dfu-util" */
    double loader_seconds;  /* for dfu-util, waiting for the loader included (120) */
    double restart_seconds; /* for the board to come back (30) */
    void *context;
    bool older;                                        /* an older version than the board's may be written */
    void (*progress)(void *context, const char *what); /* may be NULL */
    bool (*cancelled)(void *context);                  /* whether the operator wants no more; may be NULL */
    struct board_image image;                          /* filled in */
};
void lumi_rig_flash_init(struct lumi_rig_flash *flash);
/* Refuses while anything moves (LUMI_ERR_BUSY), and an older version unless it is wanted (LUMI_ERR_VERSION).
 * LUMI_ERR_CANCELLED: by the operator; the text says where the board is left. LUMI_ERR_IO: dfu-util failed, with the
 * end of what it said; or the board has not come back; or with another version than was written. */
int lumi_rig_flash(struct lumi_rig_flash *flash, struct lumi_error *error);

#endif
